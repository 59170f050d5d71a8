// SPDX-License-Identifier: GPL-2.0-or-later
//
// Buttons beside the menus: run and pause, single step, restart, speed. Each does the same as an
// item of the Run menu; its tooltip names the key.

#ifndef STAGE_GUI_WINDOW_TOOLBAR_HH
#define STAGE_GUI_WINDOW_TOOLBAR_HH

#include <FL/Fl_Button.H>
#include <FL/Fl_Menu_Button.H>

#include <deque>
#include <functional>
#include <string>

namespace Stg::internal::window {

struct WindowState;

class Toolbar {
 public:
  /// Puts the menu bar and the buttons into one row as wide as the window. Pixels.
  Toolbar(WindowState& state, Fl_Widget* menu_bar, int width, int height);

  /// Updates the buttons to the world's state and speed.
  void Refresh();

  // Accessors for tests.
  const Fl_Button& run() const { return *run_; }
  const Fl_Button& step() const { return *step_; }
  const Fl_Button& restart() const { return *restart_; }
  const Fl_Menu_Button& speed() const { return *speed_; }

 private:
  Fl_Button* AddButton(const char* symbol, const char* tooltip, std::function<void()> action);
  void AddSpeeds();
  void Act(const std::function<void()>& action);
  static void Call(Fl_Widget*, void* action) { (*static_cast<std::function<void()>*>(action))(); }

  WindowState& state_;
  int x_ = 0;  // position of the next widget
  std::deque<std::function<void()>> actions_;
  // Owned by the window.
  Fl_Button *run_, *step_, *restart_;
  Fl_Menu_Button* speed_;
  bool shows_pause_ = false;
  double shown_speed_ = 0;
};

/// Formats a speed as a multiple of real time, "2 ×" or "0.25 ×"; "max" for 0 and less.
std::string SpeedText(double speedup);

}  // namespace Stg::internal::window

#endif
