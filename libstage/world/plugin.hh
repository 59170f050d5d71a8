// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads shared libraries at run time. They are never closed. In static builds, none can be opened.

#ifndef STAGE_WORLD_PLUGIN_HH
#define STAGE_WORLD_PLUGIN_HH

#include <string>

#include "world/linked_controllers.hh"

namespace Stg {

/// Whether a plug-in must carry the stamp of this library's headers, see world/plugin_stamp.hh.
/// Backends need none: their interface has a version and a checksum of its own.
enum class Stamp { kRequired, kNone };

/// Opens a plug-in. A name with a slash is a path relative to the current directory. Other names
/// are searched in STAGEPATH, in the plug-in folder beside this library, in that of the
/// installation, and in the system's folders. Appends ".so" if missing. On failure returns null and
/// the reason in *error. A plug-in without a required stamp runs no code, except that constructors
/// of one that only the system finds have run.
void* OpenPlugin(const std::string& name, std::string* error, Stamp stamp = Stamp::kRequired);
/// Returns the address of a symbol of the plug-in, or null and the reason in *error.
void* FindSymbol(void* plugin, const char* symbol, std::string* error);
/// Returns the code of a controller's plug-in, or none and the reason in *error, such as "can't be
/// loaded: there is no ...".
ControllerCode FindPluginController(const std::string& name, std::string* error);

}  // namespace Stg

#endif
