// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/find_file.hh"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>
#include <vector>

#include "files/library_folder.hh"
#include "messages/report.hh"
#include "stage_config.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg::worldfile {
namespace {

// Returns 0 if the file is readable, otherwise the error number.
int WhyUnreadable(const std::string& path) {
  // The system would truncate the path at an embedded NUL.
  if (path.find('\0') != std::string::npos) return EINVAL;
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return EISDIR;
  return access(path.c_str(), R_OK) == 0 ? 0 : errno;
}

constexpr std::string_view kWorlds = "worlds/", kBitmaps = "bitmaps/", kRobots = "robots/";

// Folders of the worlds installed with Stage: relative to the running library, and the configured
// installation path.
std::vector<std::string> ShippedFolders() {
  std::vector<std::string> folders;
  const std::string library = files::LibraryFolder();
  if (!library.empty()) folders.push_back(library + "/" + kWorldsFromLibrary);
  if (*kWorldsDir) folders.push_back(kWorldsDir);
  return folders;
}

// Sorted names, without extension, of the shipped files with this extension.
std::vector<std::string> ShippedStems(const std::string& ending) {
  std::set<std::string> names;
  for (const std::string& folder : ShippedFolders()) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
      if (entry.path().extension() == ending) names.insert(entry.path().stem().string());
  }
  return {names.begin(), names.end()};
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
  return FindShipped(name);
}

std::string FindShipped(const std::string& name) {
  std::string_view rest = name;
  while (rest.starts_with("../")) rest.remove_prefix(3);
  if (rest.starts_with(kWorlds)) rest.remove_prefix(kWorlds.size());
  std::vector<std::string_view> subfolders = {"", kBitmaps};
  for (const std::string_view subfolder : {kBitmaps, kRobots}) {
    if (!rest.starts_with(subfolder)) continue;
    rest.remove_prefix(subfolder.size());
    subfolders = {subfolder};
    break;
  }
  if (rest.empty() || rest.find('/') != std::string_view::npos) return "";
  for (const std::string& worlds : ShippedFolders()) {
    for (const std::string_view subfolder : subfolders) {
      std::string candidate = worlds + "/" + std::string(subfolder) + std::string(rest);
      if (WhyUnreadable(candidate) == 0) return candidate;
    }
  }
  return "";
}

std::string AdviceForMissing(const std::string& directory, const std::string& name,
                             const std::string& ending) {
  const auto meant = [](const std::string& other, bool shipped) {
    return "; did you mean " + messages::Quoted(other) +
           (shipped ? ", which comes with Stage?" : "?");
  };
  if (name.empty()) return "";
  if (WhyUnreadable(CompletePath(directory, name + ending)) == 0)
    return meant(name + ending, false);
  if (!FindShipped(name + ending).empty()) return meant(name + ending, true);
  if (name.find('/') != std::string::npos) return "";
  const bool whole = name.ends_with(ending);
  const std::string stem = whole ? name.substr(0, name.size() - ending.size()) : name;
  const std::string similar = FindSimilar(stem, ShippedStems(ending));
  return similar.empty() ? "" : meant(similar + ending, true);
}

}  // namespace Stg::worldfile
