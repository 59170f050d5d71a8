// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/canvas.hh"

#include <FL/Fl.H>

#include <cstdio>

#include "gui/window/gl_display.hh"
#include "gui/window/picture.hh"
#include "gui/window/window_state.hh"
#include "messages/report.hh"
#include "threads/wall_clock.hh"

namespace Stg {

using internal::window::Picture;
using internal::window::WhyNoDisplay;
using internal::window::WindowState;

Canvas::Canvas(WindowState& state, int x, int y, int width, int height)
    : Fl_Gl_Window(x, y, width, height), state_(state), picture_(std::make_unique<Picture>()) {
  const int smooth = internal::window::HasGraphicsProcessor() ? FL_MULTISAMPLE : 0;
  mode(FL_RGB | FL_DOUBLE | FL_DEPTH | FL_STENCIL | smooth);
  end();
}

Canvas::~Canvas() = default;

std::string Canvas::WhyUnavailable() { return WhyNoDisplay(); }

view::Projection Canvas::Projection() const {
  return view::Projection(state_.view, w(), h(), state_.world.GetExtent());
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
  const int handled = state_.pointer.Handle(event);
  return handled ? handled : Fl_Gl_Window::handle(event);
}

void Canvas::draw() {
  if (!HasArea()) return;
  if (!context_valid()) internal::window::DisableVerticalSync();
  state_.FollowModel();
  picture_->Draw(state_, pixel_w(), pixel_h(), !context_valid());

  if (!state_.view.options[view::Show::kScreenshots]) return;
  std::string error;
  if (state_.screenshots.Take(pixel_w(), pixel_h(), state_.view.screenshot_skip, &error)) return;
  messages::Report(LogLevel::kError, "stage: " + error + "; no more screenshots");
  state_.view.options.Set(view::Show::kScreenshots, false);
  state_.menu.ShowOptions(state_.view.options);
}

void Canvas::flush() {
  const double start = threads::WallClock();
  Fl_Gl_Window::flush();
  state_.runner.OnFrameDrawn(start, threads::WallClock());
  state_.RefreshState();
}

}  // namespace Stg
