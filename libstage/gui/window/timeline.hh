// SPDX-License-Identifier: GPL-2.0-or-later
//
// The row below the canvas of a window that replays a log: the log's name, the time, and a slider
// to go to any time.

#ifndef STAGE_GUI_WINDOW_TIMELINE_HH
#define STAGE_GUI_WINDOW_TIMELINE_HH

#include <FL/Fl_Box.H>
#include <FL/Fl_Group.H>
#include <FL/Fl_Slider.H>

#include <functional>
#include <string>

namespace Stg::internal::window {

struct WindowState;

/// The log that a window replays. Times are simulated seconds.
struct ReplayedLog {
  std::string name;
  double start = 0, end = 0;
  std::function<void(double seconds)> seek_to;
};

class Timeline {
 public:
  static constexpr int kHeight = 28;  ///< pixels

  /// A row of this width at height y of the window, pixels.
  Timeline(WindowState& state, ReplayedLog log, int y, int width);

  const ReplayedLog& log() const { return log_; }
  /// Shows this time.
  void Refresh(double now);
  /// Moves by this many seconds, backwards if negative.
  void Skip(double seconds);
  void SeekTo(double seconds);

  const Fl_Slider& slider() const { return *slider_; }  ///< for tests
  Fl_Group* row() { return row_; }

 private:
  WindowState& state_;
  const ReplayedLog log_;
  // Owned by the window.
  Fl_Group* row_;
  Fl_Box* time_;
  Fl_Slider* slider_;
};

/// Formats minutes and seconds: "1:05.3".
std::string TimeText(double seconds);

}  // namespace Stg::internal::window

#endif
