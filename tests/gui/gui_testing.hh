// SPDX-License-Identifier: GPL-2.0-or-later
//
// Shared by tests of the window: a display for all tests of a program, and a window on it operated
// by mouse and keyboard.

#ifndef STAGE_TESTS_GUI_GUI_TESTING_HH
#define STAGE_TESTS_GUI_GUI_TESTING_HH

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "gui/view/projection.hh"
#include "gui/window/window_state.hh"
#include "gui/x_server.hh"
#include "stage.hh"
#include "threads/wall_clock.hh"

namespace gui_testing {

using Stg::internal::window::WindowState;
using Stg::threads::WallClock;

/// Input to the display of these tests.
Hand& TheHand();
/// X window id.
unsigned long WindowId(Fl_Window* window);
/// Colour of a window's pixel on the screen, 0xrrggbb.
unsigned PixelOf(Fl_Window* window, int x, int y);

/// A world in a window. Its step is 0.1 s unless the text says otherwise.
class WindowTest : public testing::Test {
 protected:
  void TearDown() override;

  /// Loads a world from a text, with real-time speed, paused.
  void Open(const std::string& text);
  /// Loads a world file and pauses it.
  void OpenFile(const std::string& file);
  /// Runs the event loop for `seconds`.
  void Run(double seconds);
  /// Runs the event loop until the condition holds; false after 10 seconds without it.
  bool RunUntil(const std::function<bool()>& condition);
  /// Waits until all events sent so far are handled and the window is drawn.
  void Settle();

  void Type(const std::string& key, const std::vector<std::string>& held = {});
  /// The following take canvas pixels.
  void MoveTo(double x, double y);
  void Click(double x, double y, int button = 1);
  void DragBy(double x, double y, int dx, int dy, int button = 1);
  /// Canvas pixel of a pose in the world.
  Stg::point_t PlaceOf(const Stg::Pose& pose);

  WindowState& state() { return world_->state(); }
  Stg::Canvas& canvas() { return *state().canvas; }

  std::unique_ptr<Stg::WorldGui> world_;
};

}  // namespace gui_testing

#endif
