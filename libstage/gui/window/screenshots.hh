// SPDX-License-Identifier: GPL-2.0-or-later
//
// Pictures that are saved as they are drawn.

#ifndef STAGE_GUI_WINDOW_SCREENSHOTS_HH
#define STAGE_GUI_WINDOW_SCREENSHOTS_HH

#include <string>

namespace Stg::internal::window {

class Screenshots {
 public:
  /// To be called after each picture, while it is in the buffer that OpenGL reads from. Writes
  /// every skip-th to stage-NNNNNN.png in the current directory, with the next number that is free
  /// there. False, with the reason, one line, if that went wrong.
  bool Take(int width, int height, int skip, std::string* error);

 private:
  int frames_ = 0;  // since the last one that was written
};

}  // namespace Stg::internal::window

#endif
