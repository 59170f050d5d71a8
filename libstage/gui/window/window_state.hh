// SPDX-License-Identifier: GPL-2.0-or-later
//
// Components and state of a WorldGui. Not for clients.

#ifndef STAGE_GUI_WINDOW_WINDOW_STATE_HH
#define STAGE_GUI_WINDOW_WINDOW_STATE_HH

#include <memory>
#include <string>
#include <vector>

#include "gui/view/view_state.hh"
#include "gui/window/canvas.hh"
#include "gui/window/dialogs.hh"
#include "gui/window/menu.hh"
#include "gui/window/picking.hh"
#include "gui/window/pointer.hh"
#include "gui/window/runner.hh"
#include "gui/window/screenshots.hh"
#include "gui/window/timeline.hh"
#include "gui/window/toolbar.hh"
#include "gui/window/world_gui.hh"

namespace Stg::internal::window {

struct WindowState {
  explicit WindowState(WorldGui& owner);

  WorldGui& world;
  view::ViewState view;
  Selection selection;
  Menu menu;  // like all widgets, its widget is owned by the window
  Toolbar toolbar;
  Canvas* canvas;  // owned by the window
  Runner runner;
  Pointer pointer;
  Screenshots screenshots;
  FilterDialog filter;
  std::unique_ptr<Timeline> timeline;  ///< null unless the window shows a log

  std::string caption;             ///< as given to the constructor
  bool loaded = false;             ///< a world is loaded
  bool shows_all = false;          ///< the world's file does not specify a view
  bool confirm_on_quit = true;     ///< the world's setting
  bool ends_at_quit_time = false;  ///< if false, pause there
  bool updating = false;           ///< a step is running
  bool dialog_open = false;        ///< a dialog waits for an answer
  std::string load_later;          ///< file to load after the current step
  bool restart_later = false;      ///< restart after the current step
  std::vector<Color> colors;       ///< stack of PushColor()

  // Actions of menus and keys.
  void Toggle(std::size_t option);
  void ResetView(bool everything);
  void TogglePause();
  void OneStep();
  /// Resets the world to its state after loading, with the same seed. Keeps the view. A log goes
  /// back to its start.
  void Restart();
  void Faster();
  void Slower();
  void SetSpeed(double speedup);
  void AskForFileToLoad();
  void Load(const std::string& file);
  void SaveToItsFile();
  void SaveAs();
  /// `suggested` is the initial name. Returns false if nothing was saved.
  bool AskForFileToSave(const std::string& suggested);
  /// Prints `message` unless the user cancels.
  void Quit(const char* message);
  void ShowFilter();

  /// Call before the world is loaded: adds a time line to the window.
  void ShowLog(ReplayedLog log);
  /// Height of the time line in pixels, if there is one.
  int ExtraHeight() const { return timeline ? Timeline::kHeight : 0; }
  /// Makes the camera follow the selected model if the option is on.
  void FollowModel();
  /// Text in the lower left corner.
  std::string ClockText() const;
  /// Call after the options were changed outside of the menus.
  void RefreshControls();
  /// Updates buttons and time line. Call for each frame.
  void RefreshState();
};

}  // namespace Stg::internal::window

#endif
