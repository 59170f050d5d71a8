// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/canvas.hh"

#include <FL/Fl.H>

#include <cstdio>

#include "gui/window/gl_display.hh"
#include "gui/window/parts.hh"
#include "gui/window/picture.hh"
#include "messages/report.hh"
#include "threads/wall_clock.hh"

namespace Stg {

using internal::window::DisplayObstacle;
using internal::window::Parts;
using internal::window::Picture;

Canvas::Canvas(Parts& parts, int x, int y, int width, int height)
    : Fl_Gl_Window(x, y, width, height), parts_(parts), picture_(std::make_unique<Picture>()) {
  const int smooth = internal::window::HasGraphicsProcessor() ? FL_MULTISAMPLE : 0;
  mode(FL_RGB | FL_DOUBLE | FL_DEPTH | FL_STENCIL | smooth);
  end();
}

Canvas::~Canvas() = default;

std::string Canvas::Obstacle() { return DisplayObstacle(); }

view::Projection Canvas::Projection() const {
  return view::Projection(parts_.view, w(), h(), parts_.world.GetExtent());
}

int Canvas::handle(int event) {
  switch (event) {
    case FL_FOCUS:
    case FL_UNFOCUS:
    case FL_ENTER:
    case FL_LEAVE:
      return 1;
    case FL_PUSH:
      take_focus();
      break;
    default:
      break;
  }
  const int handled = parts_.pointer.Handle(event);
  return handled ? handled : Fl_Gl_Window::handle(event);
}

void Canvas::draw() {
  if (!HasRoom()) return;
  if (!context_valid()) internal::window::DontWaitForScreen();
  parts_.FollowModel();
  picture_->Draw(parts_, pixel_w(), pixel_h(), !context_valid());

  if (!parts_.view.options[view::Show::kScreenshots]) return;
  std::string error;
  if (parts_.screenshots.Take(pixel_w(), pixel_h(), parts_.view.screenshot_skip, &error)) return;
  messages::Report(LogLevel::kError, "stage: " + error + "; no more screenshots");
  parts_.view.options.Set(view::Show::kScreenshots, false);
  parts_.menu.ShowOptions(parts_.view.options);
}

void Canvas::flush() {
  const double start = threads::WallClock();
  Fl_Gl_Window::flush();
  parts_.runner.Drawn(start, threads::WallClock());
  parts_.RefreshState();
}

}  // namespace Stg
