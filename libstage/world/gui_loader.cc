// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/gui_loader.hh"

#include <dlfcn.h>
#include <unistd.h>

#include "files/library_folder.hh"
#include "stage_config.hh"
#include "world/plugin.hh"

namespace Stg {

namespace {

/// Opens the library beside this one, or else wherever the system finds it.
void* OpenGui(std::string* error) {
  const std::string name = kGuiLibrary;
  std::string path = files::LibraryFolder() + "/" + name;
  if (access(path.c_str(), R_OK) != 0) path = name;
  // RTLD_GLOBAL: controllers that draw use functions of this library and of OpenGL.
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (library) return library;
  *error = dlerror();
  if (error->rfind(name + ": cannot open", 0) == 0)
    *error = name + " is not installed; install the package libstagegui5, or build Stage again " +
             "after tools/setup";
  return nullptr;
}

}  // namespace

void* FindInGui(const char* symbol, std::string* message) {
  static void* library = nullptr;
  if (!library) library = OpenGui(message);
  return library ? FindSymbol(library, symbol, message) : nullptr;
}

}  // namespace Stg
