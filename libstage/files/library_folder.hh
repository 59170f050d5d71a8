// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where the running library lies. What comes with Stage is found from there, in build trees, in
// installations, and in installations that were moved.

#ifndef STAGE_FILES_LIBRARY_FOLDER_HH
#define STAGE_FILES_LIBRARY_FOLDER_HH

#include <string>

namespace Stg::files {

/// The folder of the file that this code is in, as the system's loader knows it; "" if that is
/// unknown.
std::string LibraryFolder();

}  // namespace Stg::files

#endif
