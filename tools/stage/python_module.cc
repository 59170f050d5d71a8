// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/python_module.hh"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace Stg::program {

namespace {

namespace fs = std::filesystem;

// Arguments: a folder of packages or "", the module, and the module's own arguments. Packages in
// the working directory are not imported.
constexpr char kStart[] = R"(
import sys
sys.path[:] = [sys.argv[1]] * bool(sys.argv[1]) + [path for path in sys.path if path]
try:
    import runpy, stagesim
except ImportError as error:
    sys.exit(f"stage: can't load the Python package stagesim: {error}; try pip install ./python")
sys.argv[:3] = [sys.argv[2]]
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
)";

/// Returns the folder of this program, or an empty path if unknown.
fs::path OwnFolder() {
  std::error_code failed;
  return fs::read_symlink("/proc/self/exe", failed).parent_path();
}

bool Exists(const fs::path& path) {
  std::error_code failed;
  return fs::exists(path, failed);
}

/// Returns the folder with the package that belongs to this program. In a wheel the program is
/// stagesim/bin/stage, in a build tree bin/stage beside python/stagesim.
fs::path PackagesFolder() {
  const fs::path folder = OwnFolder();
  if (folder.empty()) return {};
  const fs::path wheel = folder.parent_path().parent_path();
  const fs::path build = folder.parent_path() / "python";
  for (const fs::path& packages : {wheel, build})
    if (Exists(packages / "stagesim" / "__init__.py")) return packages;
  return {};
}

std::string Interpreter(const fs::path& packages) {
  const char* const chosen = std::getenv("STAGE_PYTHON");
  if (chosen && *chosen) return chosen;
  const fs::path venv = packages.parent_path().parent_path() / "venv" / "bin" / "python";
  return packages.filename() == "python" && Exists(venv) ? venv.string() : "python3";
}

}  // namespace

void BecomePythonModule(const std::string& module, const std::vector<std::string>& arguments) {
  const fs::path packages = PackagesFolder();
  std::vector<std::string> words = {Interpreter(packages), "-c", kStart, packages.string(), module};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  std::fflush(stdout);
  execvp(pointers[0], pointers.data());
  throw std::runtime_error("can't run the Python interpreter '" + words[0] +
                           "' (STAGE_PYTHON): " + std::strerror(errno));
}

}  // namespace Stg::program
