// SPDX-License-Identifier: GPL-2.0-or-later
//
// Locates the running library. Stage finds its installed files relative to it, so build trees and
// relocated installations work. In static builds, the program takes the library's place.

#ifndef STAGE_FILES_LIBRARY_FOLDER_HH
#define STAGE_FILES_LIBRARY_FOLDER_HH

#include <string>

namespace Stg::files {

/// Folder of the file that contains this code, or "" if unknown.
std::string LibraryFolder();

/// Path of the shared library or program that contains the code or data at this address, as the
/// system's loader knows it, or null if unknown, as in static builds. Does not allocate.
const char* FileOfCode(const void* address) noexcept;

}  // namespace Stg::files

#endif
