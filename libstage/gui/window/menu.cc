// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/menu.hh"

#include <FL/Fl.H>

#include <cctype>

#include "gui/window/window_state.hh"

namespace Stg::internal::window {

namespace {
constexpr int kFontSize = 12;

/// Removes the word from the start of the text. Returns false if the text does not start with it.
bool CutWord(std::string* text, const std::string& word) {
  if (!text->starts_with(word)) return false;
  text->erase(0, word.size());
  return true;
}

}  // namespace

int ShortcutNumber(const std::string& text) {
  std::string key = text;
  int number = 0;
  for (bool more = true; more;) {
    more = false;
    if (CutWord(&key, "Ctrl+")) number |= FL_CTRL, more = true;
    if (CutWord(&key, "Shift+")) number |= FL_SHIFT, more = true;
  }
  if (key == "space") return number | ' ';
  if (key == "Home") return number | FL_Home;
  return key.empty() ? 0 : number | std::tolower(static_cast<unsigned char>(key[0]));
}

Menu::Menu(WindowState& state, int width, int height)
    : state_(state), bar_(new Fl_Menu_Bar(0, 0, width, height)) {
  bar_->textsize(kFontSize);
  AddFileMenu();
  AddViewMenu();
  AddOptions();
  AddRunMenu();
  AddHelpMenu();
}

void Menu::Add(const char* path, const char* shortcut, std::function<void()> action, int flags) {
  actions_.push_back(std::move(action));
  bar_->add(path, ShortcutNumber(shortcut), Call, &actions_.back(), flags);
}

void Menu::AddFileMenu() {
  Add(
      "&File/&Load World...", "Ctrl+l", [this] { state_.AskForFileToLoad(); }, FL_MENU_DIVIDER);
  Add("&File/&Save World", "Ctrl+s", [this] { state_.SaveToItsFile(); });
  Add(
      "&File/Save World &As...", "Ctrl+Shift+s", [this] { state_.SaveAs(); }, FL_MENU_DIVIDER);
  Add("&File/E&xit", "Ctrl+q", [this] { state_.Quit("User exited via menu"); });
}

void Menu::AddViewMenu() {
  Add("&View/Reset", "space", [this] { state_.ResetView(Fl::event_state(FL_CTRL) != 0); });
  Add("&View/Filter data...", "Shift+d", [this] { state_.ShowFilter(); });
}

/// Adds the view options in the order of their table.
void Menu::AddOptions() {
  const std::vector<view::Option>& options = state_.view.options.all();
  for (std::size_t i = 0; i < options.size(); i++) {
    std::string path = "&View/";
    if (options[i].place == view::Place::kDebugMenu) path += "Debug/";
    if (options[i].place == view::Place::kTrailsMenu) path += "Trails/";
    if (options[i].place == view::Place::kFilter || options[i].place == view::Place::kNowhere)
      continue;
    path += options[i].menu_name;
    Add(
        path.c_str(), options[i].shortcut.c_str(), [this, i] { state_.Toggle(i); },
        FL_MENU_TOGGLE | (options[i].on ? FL_MENU_VALUE : 0));
    ticks_.emplace_back(i, path);
  }
}

void Menu::AddRunMenu() {
  Add("Run/Pause", "p", [this] { state_.TogglePause(); });
  Add("Run/One step", ".", [this] { state_.OneStep(); });
  Add(
      "Run/Restart", "Home", [this] { state_.Restart(); }, FL_MENU_DIVIDER);
  Add("Run/Faster", "]", [this] { state_.Faster(); });
  Add(
      "Run/Slower", "[", [this] { state_.Slower(); }, FL_MENU_DIVIDER);
  Add("Run/Realtime", "{", [this] { state_.SetSpeed(1); });
  Add("Run/Fast", "}", [this] { state_.SetSpeed(-1); });
}

void Menu::AddSkips(const std::function<void(double)>& skip) {
  constexpr double kSeconds = 10;
  Add("Run/Back 10 s", "<", [skip] { skip(-kSeconds); });
  Add("Run/On 10 s", ">", [skip] { skip(kSeconds); });
}

void Menu::AddHelpMenu() {
  Add(
      "&Help/Getting help...", "", [] { ShowHelp(); }, FL_MENU_DIVIDER);
  Add("&Help/&About Stage...", "", [] { ShowAbout(); });
}

void Menu::ShowOptions(const view::ViewOptions& options) {
  for (const auto& [option, path] : ticks_) {
    const int item = bar_->find_index(path.c_str());
    if (item < 0) continue;
    const int mode = bar_->mode(item) & ~FL_MENU_VALUE;
    bar_->mode(item, options.all()[option].on ? mode | FL_MENU_VALUE : mode);
  }
}

bool Menu::HandleShortcut() { return bar_->handle(FL_SHORTCUT) != 0; }

}  // namespace Stg::internal::window
