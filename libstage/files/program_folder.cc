// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replaces library_folder.cc in static builds.

#include <filesystem>
#include <system_error>

#include "files/library_folder.hh"

namespace Stg::files {

std::string LibraryFolder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path().string();
}

const char* FileOfCode(const void*) noexcept { return nullptr; }

}  // namespace Stg::files
