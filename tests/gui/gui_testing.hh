// SPDX-License-Identifier: GPL-2.0-or-later
//
// What tests of the window share: a display that all tests of a program use, and a window on it
// that is operated by mouse and keys.

#ifndef STAGE_TESTS_GUI_GUI_TESTING_HH
#define STAGE_TESTS_GUI_GUI_TESTING_HH

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "gui/view/projection.hh"
#include "gui/window/parts.hh"
#include "gui/x_server.hh"
#include "stage.hh"

namespace gui_testing {

using Stg::internal::window::Now;
using Stg::internal::window::Parts;

/// The hand on the display of these tests.
Hand& TheHand();
/// X's number of a window.
unsigned long WindowId(Fl_Window* window);
/// The colour of a pixel of a window on the screen, as 0xrrggbb.
unsigned PixelOf(Fl_Window* window, int x, int y);

/// A world in a window. Its step is 0.1 s unless the text says otherwise.
class WindowTest : public testing::Test {
 protected:
  void TearDown() override;

  /// Loads a world from a text, at real time but paused.
  void Open(const std::string& text);
  /// Loads a world file, and pauses it.
  void OpenFile(const std::string& file);
  /// Runs the event loop for so many seconds.
  void Run(double seconds);
  /// Runs the event loop until the condition holds; false if it doesn't within 10 seconds.
  bool RunUntil(const std::function<bool()>& condition);
  /// The events that were sent so far have been dealt with, and the window is drawn.
  void Settle();

  void Type(const std::string& key, const std::vector<std::string>& held = {});
  /// Pixels of the canvas.
  void MoveTo(double x, double y);
  void Click(double x, double y, int button = 1);
  void DragBy(double x, double y, int dx, int dy, int button = 1);
  /// Where on the canvas a point of the world is.
  Stg::point_t PlaceOf(const Stg::Pose& pose);

  Parts& parts() { return world_->parts(); }
  Stg::Canvas& canvas() { return *parts().canvas; }

  std::unique_ptr<Stg::WorldGui> world_;
};

}  // namespace gui_testing

#endif
