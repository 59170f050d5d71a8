// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads libstagegui, the library of the window and of pictures. The core knows nothing else of it.

#ifndef STAGE_WORLD_GUI_LOADER_HH
#define STAGE_WORLD_GUI_LOADER_HH

#include <string>

namespace Stg {

/// An extern "C" function of libstagegui, which is loaded on the first call and never closed. Null
/// and the reason, one line, if there is none.
void* FindInGui(const char* symbol, std::string* message);

}  // namespace Stg

#endif
