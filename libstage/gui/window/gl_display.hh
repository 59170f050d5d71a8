// SPDX-License-Identifier: GPL-2.0-or-later
//
// OpenGL capabilities of the X display.

#ifndef STAGE_GUI_WINDOW_GL_DISPLAY_HH
#define STAGE_GUI_WINDOW_GL_DISPLAY_HH

#include <string>

namespace Stg::internal::window {

/// Returns an empty string if a window with OpenGL can be opened, otherwise a one-line reason.
std::string WhyNoDisplay();

/// True if a graphics processor renders, which makes antialiasing cheap.
bool HasGraphicsProcessor();

/// Disables vertical sync for the current context, so that the simulation does not wait for the
/// screen.
void DisableVerticalSync();

}  // namespace Stg::internal::window

#endif
