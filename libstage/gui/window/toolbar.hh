// SPDX-License-Identifier: GPL-2.0-or-later
//
// Buttons beside the menus: run and pause, one step, begin anew, speed. Each of them does what an
// item of the menu Run does, whose key its tooltip names.

#ifndef STAGE_GUI_WINDOW_TOOLBAR_HH
#define STAGE_GUI_WINDOW_TOOLBAR_HH

#include <FL/Fl_Button.H>
#include <FL/Fl_Menu_Button.H>

#include <deque>
#include <functional>
#include <string>

namespace Stg::internal::window {

struct Parts;

class Toolbar {
 public:
  /// Puts the menu bar and the buttons into one row that is as wide as the window, pixels.
  Toolbar(Parts& parts, Fl_Widget* menu_bar, int width, int height);

  /// Shows whether the world runs, and how fast it is to run.
  void Refresh();

  // For tests.
  const Fl_Button& run() const { return *run_; }
  const Fl_Button& step() const { return *step_; }
  const Fl_Button& restart() const { return *restart_; }
  const Fl_Menu_Button& speed() const { return *speed_; }

 private:
  Fl_Button* AddButton(const char* symbol, const char* tooltip, std::function<void()> action);
  void AddSpeeds();
  void Act(const std::function<void()>& action);
  static void Call(Fl_Widget*, void* action) { (*static_cast<std::function<void()>*>(action))(); }

  Parts& parts_;
  int x_ = 0;  // where the next widget goes
  std::deque<std::function<void()>> actions_;
  // Widgets belong to the window.
  Fl_Button *run_, *step_, *restart_;
  Fl_Menu_Button* speed_;
  bool shows_pause_ = false;
  double shown_speed_ = 0;
};

/// "2 ×", "¼ ×", "max": a speed as multiple of real time; 0 and less: as fast as possible.
std::string SpeedText(double speedup);

}  // namespace Stg::internal::window

#endif
