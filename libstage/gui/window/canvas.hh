// SPDX-License-Identifier: GPL-2.0-or-later
//
// The widget that the world is drawn in.

#ifndef STAGE_GUI_WINDOW_CANVAS_HH
#define STAGE_GUI_WINDOW_CANVAS_HH

#include <FL/Fl_Gl_Window.H>

#include <memory>
#include <string>

#include "gui/view/projection.hh"

namespace Stg {

namespace internal::window {
struct WindowState;
class Picture;
}  // namespace internal::window

class Canvas : public Fl_Gl_Window {
 public:
  Canvas(internal::window::WindowState& state, int x, int y, int width, int height);
  ~Canvas() override;

  int handle(int event) override;
  void draw() override;
  /// Calls draw() and swaps the two buffers.
  void flush() override;

  /// Maps pixels to metres and back, as the next frame will.
  view::Projection Projection() const;
  /// True if the canvas has an area to draw to.
  bool HasArea() const { return w() > 0 && h() > 0; }

  /// Returns an empty string if this display supports a canvas, otherwise a one-line reason.
  static std::string WhyUnavailable();

 private:
  internal::window::WindowState& state_;
  std::unique_ptr<internal::window::Picture> picture_;
};

}  // namespace Stg

#endif
