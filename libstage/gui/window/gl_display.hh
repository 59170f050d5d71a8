// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the X display can do with OpenGL.

#ifndef STAGE_GUI_WINDOW_GL_DISPLAY_HH
#define STAGE_GUI_WINDOW_GL_DISPLAY_HH

#include <string>

namespace Stg::internal::window {

/// Empty if a window with OpenGL can be had; otherwise why not, one line.
std::string DisplayObstacle();

/// Whether smooth edges come for free: pictures are made by a processor of their own.
bool HasGraphicsProcessor();

/// Lets pictures of the current context appear at once. Otherwise the simulation would wait for the
/// screen, many times a second.
void DontWaitForScreen();

}  // namespace Stg::internal::window

#endif
