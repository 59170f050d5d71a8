// SPDX-License-Identifier: GPL-2.0-or-later
//
// A framebuffer that keeps its content from frame to frame, unlike a double-buffered window.

#ifndef STAGE_GUI_DRAW_CACHED_FRAME_HH
#define STAGE_GUI_DRAW_CACHED_FRAME_HH

#include "gui/draw/gl_program.hh"

namespace Stg::draw {

class CachedFrame {
 public:
  /// Redirects drawing into this framebuffer. Returns false if it has no content of that size yet.
  bool Begin(int width, int height);
  /// Copies the content to the framebuffer that was bound before Begin(), and binds that again.
  void End();
  void Delete();
  /// Forgets all objects after the context was destroyed.
  void Forget() { *this = CachedFrame(); }

 private:
  void Make(int width, int height);

  GLuint frame_ = 0, color_ = 0, depth_ = 0;
  GLint target_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace Stg::draw

#endif
