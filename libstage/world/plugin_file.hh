// SPDX-License-Identifier: GPL-2.0-or-later
//
// Looks at the file of a shared library before the loader does, which waits for ever for a pipe and
// dies of a file that was cut short.

#ifndef STAGE_WORLD_PLUGIN_FILE_HH
#define STAGE_WORLD_PLUGIN_FILE_HH

#include <string>

namespace Stg {

/// Why the file can't be a shared library for this process; empty if it can. `own_header`: that of
/// one that is loaded.
std::string FaultOfPlugin(const std::string& path, const void* own_header);

}  // namespace Stg

#endif
