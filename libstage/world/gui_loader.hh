// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads libstagegui, which contains the window and renders pictures, on demand.

#ifndef STAGE_WORLD_GUI_LOADER_HH
#define STAGE_WORLD_GUI_LOADER_HH

#include <string>

namespace Stg {

/// Returns an extern "C" function of libstagegui. Loads the library on first use and never closes
/// it. On failure returns null and a message of one line.
void* FindInGui(const char* symbol, std::string* message);

}  // namespace Stg

#endif
