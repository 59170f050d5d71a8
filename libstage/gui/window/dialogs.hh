// SPDX-License-Identifier: GPL-2.0-or-later
//
// Dialogs and secondary windows. The simulation keeps running while they are open.

#ifndef STAGE_GUI_WINDOW_DIALOGS_HH
#define STAGE_GUI_WINDOW_DIALOGS_HH

#include <memory>
#include <string>

class Fl_Window;

namespace Stg::internal::window {

struct WindowState;

/// The dialog "Visualize" with the switches of what models show.
class FilterDialog {
 public:
  explicit FilterDialog(WindowState& state);
  ~FilterDialog();

  /// Opens the dialog beside the main window, or closes it.
  void Toggle();
  void Close();
  /// Call after the options or their values have changed.
  void Refresh();

 private:
  class Window;
  WindowState& state_;
  std::unique_ptr<Window> window_;
};

void ShowHelp();
void ShowAbout();
void Alert(const std::string& text);

/// Ask for a file and return "" if the user cancels. Replacing a file needs a confirmation.
std::string ChooseFileToLoad(const std::string& present);
std::string ChooseFileToSave(const std::string& suggested);
/// Returns an unused name beside the file: "cave-1.world" for "cave.world".
std::string FreeNameBeside(const std::string& file);

enum class QuitAnswer { kCancel, kSave, kQuit };
QuitAnswer AskBeforeQuitting();

}  // namespace Stg::internal::window

#endif
