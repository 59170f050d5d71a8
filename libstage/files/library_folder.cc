// SPDX-License-Identifier: GPL-2.0-or-later

#include "files/library_folder.hh"

#include <dlfcn.h>

namespace Stg::files {

std::string LibraryFolder() {
  const char* const file = FileOfCode(reinterpret_cast<const void*>(&LibraryFolder));
  if (!file) return "";
  const std::string path = file;
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : path.substr(0, slash);
}

const char* FileOfCode(const void* address) noexcept {
  Dl_info info = {};
  return dladdr(address, &info) != 0 ? info.dli_fname : nullptr;
}

}  // namespace Stg::files
