// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a WorldGui consists of. Not for clients.

#ifndef STAGE_GUI_WINDOW_PARTS_HH
#define STAGE_GUI_WINDOW_PARTS_HH

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

struct Parts {
  explicit Parts(WorldGui& owner);

  WorldGui& world;
  view::ViewState view;
  Selection selection;
  Menu menu;  // its widget belongs to the window, as all widgets do
  Toolbar toolbar;
  Canvas* canvas;  // belongs to the window
  Runner runner;
  Pointer pointer;
  Screenshots screenshots;
  FilterDialog filter;
  std::unique_ptr<Timeline> timeline;  ///< null: the window does not show a log

  std::string caption;             ///< as given to the constructor
  bool loaded = false;             ///< there is a world in it
  bool shows_all = false;          ///< its file does not say what part of it is to be seen
  bool confirm_on_quit = true;     ///< of the world
  bool ends_at_quit_time = false;  ///< instead of pausing there
  bool updating = false;           ///< within a step
  bool asking = false;             ///< a question is on the screen
  std::string load_later;          ///< a file to load when the step is over
  bool restart_later = false;      ///< begin anew when the step is over
  std::vector<Color> colors;       ///< the stack of PushColor()

  // What the menu and the keys do.
  void Toggle(std::size_t option);
  void ResetView(bool everything);
  void TogglePause();
  void OneStep();
  /// The world is as it was when it was loaded, with the same seed, and the view stays as it is. A
  /// log goes back to its start.
  void Restart();
  void Faster();
  void Slower();
  void SetSpeed(double speedup);
  void AskForFileToLoad();
  void Load(const std::string& file);
  void SaveToItsFile();
  void SaveAs();
  /// `suggested`: the name to begin with. False if nothing was saved.
  bool AskForFileToSave(const std::string& suggested);
  /// `message` is printed if it comes to that.
  void Quit(const char* message);
  void ShowFilter();

  /// To be called before the world is loaded: adds a time line to the window.
  void ShowLog(ReplayedLog log);
  /// Pixels of the window beside the canvas and the menus.
  int ExtraHeight() const { return timeline ? Timeline::kHeight : 0; }
  /// The pictures follow this model, if it is wanted and there is one.
  void FollowModel();
  /// What stands in the lower left corner.
  std::string ClockText() const;
  /// Options have been changed from outside.
  void RefreshControls();
  /// The buttons and the time line show how things are now. For each picture.
  void RefreshState();
};

}  // namespace Stg::internal::window

#endif
