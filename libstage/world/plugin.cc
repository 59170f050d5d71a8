// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/plugin.hh"

#include <dlfcn.h>
#include <link.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>
#include <vector>

#include "files/library_folder.hh"
#include "messages/report.hh"
#include "stage_config.hh"
#include "world/plugin_file.hh"

namespace Stg {

namespace {

/// The loader's description of the library that contains this code.
Dl_info OwnLibrary() {
  Dl_info info = {};
  dladdr(reinterpret_cast<void*>(&OpenPlugin), &info);
  return info;
}

/// Plug-in folder beside the library that contains this code. Correct in build trees and relocated
/// installations.
std::string FolderBesideLibrary() {
  const std::string folder = files::LibraryFolder();
  return folder.empty() ? "" : folder + "/" + kPluginSubdir;
}

/// Folders in a colon-separated environment variable.
std::vector<std::string> FoldersOf(const char* variable) {
  std::vector<std::string> folders;
  if (const char* list = std::getenv(variable)) {
    std::istringstream parts(list);
    for (std::string part; std::getline(parts, part, ':');)
      if (!part.empty()) folders.push_back(part);
  }
  return folders;
}

std::vector<std::string> PluginFolders() {
  std::vector<std::string> folders = FoldersOf("STAGEPATH");
  folders.push_back(FolderBesideLibrary());
  if (*kPluginDir) folders.push_back(kPluginDir);
  return folders;
}

std::string WithSuffix(const std::string& name) {
  return name.size() > 3 && name.ends_with(".so") ? name : name + ".so";
}

void* Open(const std::string& file, std::string* error) {
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) *error = dlerror();
  return handle;
}

/// Opens a plug-in file after checking it.
void* OpenFile(const std::string& path, Stamp stamp, std::string* error) {
  *error = FaultOfPlugin(path, OwnLibrary().dli_fbase);
  if (error->empty() && stamp == Stamp::kRequired) *error = FaultOfStamp(path);
  return error->empty() ? Open(path, error) : nullptr;
}

/// Returns the file of an open library.
std::string PathOf(void* handle) {
  const link_map* map = nullptr;
  return dlinfo(handle, RTLD_DI_LINKMAP, &map) == 0 && map ? map->l_name : "";
}

}  // namespace

void* OpenPlugin(const std::string& name, std::string* error, Stamp stamp) {
  const std::string file = WithSuffix(name);
  if (name.find('/') != std::string::npos) {
    void* const handle = OpenFile(file, stamp, error);
    // The caller's message names the file already.
    if (error->starts_with(file + ": ")) error->erase(0, file.size() + 2);
    return handle;
  }
  constexpr std::size_t kFewBytes = 40;  // the message contains the name already
  std::string tried;
  for (const std::string& folder : PluginFolders()) {
    const std::string path = folder + "/" + file;
    if (access(path.c_str(), F_OK) == 0) return OpenFile(path, stamp, error);
    tried += (tried.empty() ? "" : ", ") + folder;
  }
  for (const std::string& folder : FoldersOf("LD_LIBRARY_PATH")) {
    const std::string path = folder + "/" + file;
    if (access(path.c_str(), F_OK) == 0) return OpenFile(path, stamp, error);
  }
  if (void* handle = Open(file, error)) {  // in a folder of the system
    *error = stamp == Stamp::kRequired ? FaultOfStamp(PathOf(handle)) : "";
    return error->empty() ? handle : nullptr;
  }
  *error = "there is no " + messages::Shortened(file, kFewBytes) + " in " + tried +
           " nor in the system's folders";
  return nullptr;
}

void* FindSymbol(void* plugin, const char* symbol, std::string* error) {
  void* address = dlsym(plugin, symbol);
  if (!address) *error = dlerror();
  return address;
}

ControllerCode FindPluginController(const std::string& name, std::string* error) {
  using GetBatchController = const BatchController* (*)();
  void* const library = OpenPlugin(name, error);
  void* const batch = library ? dlsym(library, "StageBatchController") : nullptr;
  if (batch) return {nullptr, reinterpret_cast<GetBatchController>(batch)()};
  void* const init = library ? FindSymbol(library, "Init", error) : nullptr;
  if (init) return {reinterpret_cast<ControllerInit>(init), nullptr};
  const bool elsewhere = error->starts_with("there is no ");
  *error = std::string("can't be ") + (library ? "used: " : "loaded: ") +
           messages::Shortened(*error, messages::kMaxDetailBytes) +
           (elsewhere ? "; STAGEPATH names further folders to look in" : "");
  return {};
}

}  // namespace Stg
