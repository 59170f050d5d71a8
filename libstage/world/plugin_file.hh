// SPDX-License-Identifier: GPL-2.0-or-later
//
// Checks the file of a shared library before the system's loader opens it: the loader hangs on
// pipes and crashes on truncated files.

#ifndef STAGE_WORLD_PLUGIN_FILE_HH
#define STAGE_WORLD_PLUGIN_FILE_HH

#include <string>

namespace Stg {

/// Returns why the file cannot be a shared library for this process, or "" if it can. `own_header`
/// is the ELF header of a loaded library, or null.
std::string FaultOfPlugin(const std::string& path, const void* own_header);

/// Returns why a plug-in does not fit the headers of this library, or "" if it does: it must carry
/// STAGE_PLUGIN_STAMP and no other stamp. A file that cannot be read has no fault.
std::string FaultOfStamp(const std::string& path);

}  // namespace Stg

#endif
