// SPDX-License-Identifier: GPL-2.0-or-later
//
// Makes the pictures of a window.

#ifndef STAGE_GUI_WINDOW_PICTURE_HH
#define STAGE_GUI_WINDOW_PICTURE_HH

namespace Stg::internal::window {

struct Parts;

class Picture {
 public:
  /// In the current context. `fresh`: nothing of what was drawn before is left in it.
  void Draw(Parts& parts, int width, int height, bool fresh);
};

}  // namespace Stg::internal::window

#endif
