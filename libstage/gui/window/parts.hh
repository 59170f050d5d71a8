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
#include "gui/window/world_gui.hh"

namespace Stg::internal::window {

struct Parts {
  explicit Parts(WorldGui& owner);

  WorldGui& world;
  view::ViewState view;
  Selection selection;
  Menu menu;       // its widget belongs to the window, as all widgets do
  Canvas* canvas;  // belongs to the window
  Runner runner;
  Pointer pointer;
  Screenshots screenshots;
  FilterDialog filter;

  std::string caption;             ///< as given to the constructor
  bool loaded = false;             ///< there is a world in it
  bool confirm_on_quit = true;     ///< of the world
  bool ends_at_quit_time = false;  ///< instead of pausing there
  bool updating = false;           ///< within a step
  bool asking = false;             ///< a question is on the screen
  std::string load_later;          ///< a file to load when the step is over
  std::vector<Color> colors;       ///< the stack of PushColor()

  // What the menu and the keys do.
  void Toggle(std::size_t option);
  void ResetView(bool everything);
  void TogglePause();
  void OneStep();
  void Faster();
  void Slower();
  void SetSpeed(double speedup);
  void AskForFileToLoad();
  void Load(const std::string& file);
  void SaveToItsFile();
  /// False if nothing was saved.
  bool AskForFileToSave();
  /// `message` is printed if it comes to that.
  void Quit(const char* message);
  void ShowFilter();

  /// The pictures follow this model, if it is wanted and there is one.
  void FollowModel();
  /// What stands in the lower left corner.
  std::string ClockText() const;
  /// Options have been changed from outside.
  void RefreshControls();
};

}  // namespace Stg::internal::window

#endif
