// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/find_file.hh"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace Stg::worldfile {
namespace {

// 0 if the file can be read, else the error number that says why not.
int WhyUnreadable(const std::string& path) {
  // An embedded NUL would make the system see another, shorter path.
  if (path.find('\0') != std::string::npos) return EINVAL;
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return EISDIR;
  return access(path.c_str(), R_OK) == 0 ? 0 : errno;
}

}  // namespace

std::string CompletePath(const std::string& directory, const std::string& name) {
  const bool complete = !name.empty() && (name[0] == '/' || name[0] == '~');
  if (complete || directory.empty()) return name;
  return directory + "/" + name;
}

std::string DirectoryOf(const std::string& file) {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::path(file).parent_path();
  if (parent.is_absolute()) return parent.string();
  const std::filesystem::path here = std::filesystem::current_path(error);
  return parent.empty() ? here.string() : (here / parent).string();
}

std::string FindFile(const std::string& directory, const std::string& name, std::string* reason) {
  std::string wanted = CompletePath(directory, name);
  const int error = WhyUnreadable(wanted);
  if (error == 0) return wanted;
  if (reason != nullptr) *reason = std::generic_category().message(error);

  const std::string last = name.substr(name.find_last_of('/') + 1);
  const char* variable = std::getenv("STAGEPATH");
  std::string_view rest = variable != nullptr && !last.empty() ? variable : "";
  while (!rest.empty()) {
    const std::size_t end = rest.find(':');
    const std::string folder(rest.substr(0, end));
    rest = end == std::string_view::npos ? "" : rest.substr(end + 1);
    if (folder.empty()) continue;
    std::string candidate = folder + "/" + last;
    if (WhyUnreadable(candidate) == 0) return candidate;
  }
  return "";
}

}  // namespace Stg::worldfile
