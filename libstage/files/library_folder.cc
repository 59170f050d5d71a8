// SPDX-License-Identifier: GPL-2.0-or-later

#include "files/library_folder.hh"

#include <dlfcn.h>

namespace Stg::files {

std::string LibraryFolder() {
  Dl_info info = {};
  if (dladdr(reinterpret_cast<void*>(&LibraryFolder), &info) == 0 || !info.dli_fname) return "";
  const std::string path = info.dli_fname;
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : path.substr(0, slash);
}

}  // namespace Stg::files
