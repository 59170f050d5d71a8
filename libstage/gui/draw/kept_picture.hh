// SPDX-License-Identifier: GPL-2.0-or-later
//
// A framebuffer that keeps its picture from frame to frame, which windows with two buffers do not.

#ifndef STAGE_GUI_DRAW_KEPT_PICTURE_HH
#define STAGE_GUI_DRAW_KEPT_PICTURE_HH

#include "gui/draw/gl_program.hh"

namespace Stg::draw {

class KeptPicture {
 public:
  /// Draw into it from now on. False if it holds no picture of that size yet.
  bool Begin(int width, int height);
  /// Copies it to the framebuffer that was bound before Begin(), and binds that one again.
  void End();
  void Delete();
  /// The context is gone.
  void Forget() { *this = KeptPicture(); }

 private:
  void Make(int width, int height);

  GLuint frame_ = 0, color_ = 0, depth_ = 0;
  GLint target_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace Stg::draw

#endif
