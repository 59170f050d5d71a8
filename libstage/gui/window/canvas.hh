// SPDX-License-Identifier: GPL-2.0-or-later
//
// The area that the world is drawn in.

#ifndef STAGE_GUI_WINDOW_CANVAS_HH
#define STAGE_GUI_WINDOW_CANVAS_HH

#include <FL/Fl_Gl_Window.H>

#include <memory>
#include <string>

#include "gui/view/projection.hh"

namespace Stg {

namespace internal::window {
struct Parts;
class Picture;
}  // namespace internal::window

class Canvas : public Fl_Gl_Window {
 public:
  Canvas(internal::window::Parts& parts, int x, int y, int width, int height);
  ~Canvas() override;

  int handle(int event) override;
  void draw() override;
  /// draw(), and the exchange of the two buffers.
  void flush() override;

  /// From pixels to metres and back, as the next picture will have it.
  view::Projection Projection() const;
  /// Whether there is a picture to be made: not in a window of no size.
  bool HasRoom() const { return w() > 0 && h() > 0; }

  /// Empty if a canvas can be had on this display; otherwise the reason, one line.
  static std::string Obstacle();

 private:
  internal::window::Parts& parts_;
  std::unique_ptr<internal::window::Picture> picture_;
};

}  // namespace Stg

#endif
