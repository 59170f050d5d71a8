// SPDX-License-Identifier: GPL-2.0-or-later
//
// The menu bar. Its shortcuts are all keys of the window, except for the arrow keys.

#ifndef STAGE_GUI_WINDOW_MENU_HH
#define STAGE_GUI_WINDOW_MENU_HH

#include <FL/Fl_Menu_Bar.H>

#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace Stg::view {
class ViewOptions;
}

namespace Stg::internal::window {

struct WindowState;

class Menu {
 public:
  Menu(WindowState& state, int width, int height);

  Fl_Menu_Bar* bar() { return bar_; }
  /// Updates the check marks from the options.
  void ShowOptions(const view::ViewOptions& options);
  /// Runs the item whose shortcut was just pressed. Returns false if there is none.
  bool HandleShortcut();

  /// Adds items that call `skip` with simulated seconds to jump by, negative to go back.
  void AddSkips(const std::function<void(double)>& skip);

 private:
  void Add(const char* path, const char* shortcut, std::function<void()> action, int flags = 0);
  void AddFileMenu();
  void AddViewMenu();
  void AddOptions();
  void AddRunMenu();
  void AddHelpMenu();
  static void Call(Fl_Widget*, void* action) { (*static_cast<std::function<void()>*>(action))(); }

  WindowState& state_;
  Fl_Menu_Bar* bar_;  // owned by the window
  std::deque<std::function<void()>> actions_;
  std::vector<std::pair<std::size_t, std::string>> ticks_;  // option index, path of its item
};

/// FLTK's key code of "d", "Ctrl+O", "Ctrl+Shift+S", "space", "Home"; 0 for an empty text.
int ShortcutNumber(const std::string& text);

}  // namespace Stg::internal::window

#endif
