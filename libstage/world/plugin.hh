// SPDX-License-Identifier: GPL-2.0-or-later
//
// Shared libraries loaded at run time. They are never closed.

#ifndef STAGE_WORLD_PLUGIN_HH
#define STAGE_WORLD_PLUGIN_HH

#include <string>

namespace Stg {

/// Opens a plug-in. A name with a slash is a file, relative to the current directory. Any other is
/// looked for in the directories of STAGEPATH, in the plug-in directory beside this library, in
/// that of the installation, and where the system looks. ".so" is added if it is missing.
/// Returns null and the loader's reason in *error.
void* OpenPlugin(const std::string& name, std::string* error);
/// A symbol of it, or null and the reason.
void* FindSymbol(void* plugin, const char* symbol, std::string* error);

}  // namespace Stg

#endif
