// SPDX-License-Identifier: GPL-2.0-or-later
//
// Locates the running library. Stage finds its installed files relative to it, so build trees and
// relocated installations work.

#ifndef STAGE_FILES_LIBRARY_FOLDER_HH
#define STAGE_FILES_LIBRARY_FOLDER_HH

#include <string>

namespace Stg::files {

/// Folder of the file that contains this code, as the system's loader knows it, or "" if unknown.
std::string LibraryFolder();

}  // namespace Stg::files

#endif
