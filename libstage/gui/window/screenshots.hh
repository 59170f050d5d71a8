// SPDX-License-Identifier: GPL-2.0-or-later
//
// Saves frames as they are drawn.

#ifndef STAGE_GUI_WINDOW_SCREENSHOTS_HH
#define STAGE_GUI_WINDOW_SCREENSHOTS_HH

#include <string>

namespace Stg::internal::window {

class Screenshots {
 public:
  /// Call after each frame, before its buffer changes. Writes every skip-th frame to
  /// stage-NNNNNN.png in the current directory, with the next unused number. Returns false and a
  /// one-line reason on failure.
  bool Take(int width, int height, int skip, std::string* error);

 private:
  int frames_ = 0;  // since the last one that was saved
};

}  // namespace Stg::internal::window

#endif
