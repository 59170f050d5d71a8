// SPDX-License-Identifier: GPL-2.0-or-later
//
// The row below the canvas of a window that shows a log again: the log's name, the time, and a
// slider that goes to any other.

#ifndef STAGE_GUI_WINDOW_TIMELINE_HH
#define STAGE_GUI_WINDOW_TIMELINE_HH

#include <FL/Fl_Box.H>
#include <FL/Fl_Group.H>
#include <FL/Fl_Slider.H>

#include <functional>
#include <string>

namespace Stg::internal::window {

struct Parts;

/// A log that a window shows. Times are simulated seconds.
struct ReplayedLog {
  std::string name;
  double start = 0, end = 0;
  std::function<void(double seconds)> go_to;
};

class Timeline {
 public:
  static constexpr int kHeight = 28;  ///< pixels

  /// A row of that width at that height of the window.
  Timeline(Parts& parts, ReplayedLog log, int y, int width);

  const ReplayedLog& log() const { return log_; }
  /// Shows that time.
  void Refresh(double now);
  /// Goes so many seconds on, or back if they are negative.
  void Skip(double seconds);
  void GoTo(double seconds);

  const Fl_Slider& slider() const { return *slider_; }  ///< for tests
  Fl_Group* row() { return row_; }

 private:
  Parts& parts_;
  const ReplayedLog log_;
  // Widgets belong to the window.
  Fl_Group* row_;
  Fl_Box* time_;
  Fl_Slider* slider_;
};

/// "1:05.3": minutes and seconds.
std::string TimeText(double seconds);

}  // namespace Stg::internal::window

#endif
