// SPDX-License-Identifier: GPL-2.0-or-later
//
// The windows beside the main one, and questions. The simulation goes on under all of them.

#ifndef STAGE_GUI_WINDOW_DIALOGS_HH
#define STAGE_GUI_WINDOW_DIALOGS_HH

#include <memory>
#include <string>

class Fl_Window;

namespace Stg::internal::window {

struct Parts;

/// "Visualize": the switches of what models show.
class FilterDialog {
 public:
  explicit FilterDialog(Parts& parts);
  ~FilterDialog();

  /// Opens it beside the main window, or closes it.
  void Toggle();
  void Close();
  /// The options are others now, or have changed.
  void Refresh();

 private:
  class Window;
  Parts& parts_;
  std::unique_ptr<Window> window_;
};

void ShowHelp();
void ShowAbout();
void Alert(const std::string& text);

/// A file of the user's choice; empty: none. What exists is replaced only if the user says so.
std::string ChooseFileToLoad(const std::string& present);
std::string ChooseFileToSave(const std::string& suggested);
/// A name beside that file that nothing has yet: "cave-1.world" for "cave.world".
std::string FreeNameBeside(const std::string& file);

enum class QuitAnswer { kCancel, kSave, kQuit };
QuitAnswer AskBeforeQuitting();

}  // namespace Stg::internal::window

#endif
