// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/dialogs.hh"

#include <FL/Fl.H>
#include <FL/Fl_Check_Button.H>
#include <FL/Fl_File_Chooser.H>
#include <FL/Fl_Multiline_Output.H>
#include <FL/Fl_Return_Button.H>
#include <FL/Fl_Scroll.H>
#include <FL/Fl_Text_Display.H>
#include <FL/Fl_Window.H>
#include <FL/fl_ask.H>

#include <cstdlib>
#include <filesystem>

#include "gui/window/logo.hh"
#include "gui/window/window_state.hh"
#include "stage.hh"

namespace Stg::internal::window {

// ---- data filter --------------------------------------------------------------------------------

/// Passes keys that it does not use to the main window.
class FilterDialog::Window : public Fl_Window {
 public:
  static constexpr int kWidth = 180, kHeight = 250, kRow = 30, kGap = 10, kText = 12;

  explicit Window(WindowState& state) : Fl_Window(kWidth, kHeight, "Visualize"), state_(state) {
    auto* frame = new Fl_Group(0, 0, kWidth, kRow);
    frame->box(FL_ENGRAVED_FRAME);
    AddButton(static_cast<std::size_t>(view::Show::kSelectedOnly), 0, kWidth);
    frame->end();
    list_ = new Fl_Scroll(0, kRow, kWidth, kHeight - kRow);
    list_->type(Fl_Scroll::VERTICAL);
    list_->end();
    end();
    resizable(list_);
    set_non_modal();  // keeps it above the main window
  }

  void Fill() {
    list_->clear();
    list_->scroll_to(0, 0);
    list_->begin();
    int y = list_->y();
    for (const std::size_t option : state_.view.options.Filter()) {
      AddButton(option, y, kWidth - Fl::scrollbar_size());
      y += kRow;
    }
    list_->end();
    list_->redraw();
  }

  int handle(int event) override {
    if (Fl_Window::handle(event)) return 1;
    return event == FL_SHORTCUT && state_.menu.HandleShortcut() ? 1 : 0;
  }

 private:
  class Button : public Fl_Check_Button {
   public:
    Button(WindowState& state, std::size_t option, int y, int width)
        : Fl_Check_Button(0, y, width, kRow), state_(state), option_(option) {
      const view::Option& of = state.view.options.all()[option];
      copy_label(of.menu_name.c_str());
      labelsize(kText);
      value(of.on ? 1 : 0);
      callback([](Fl_Widget* widget, void*) { static_cast<Button*>(widget)->Act(); });
    }

   private:
    void Act() {
      state_.view.options.Set(option_, value() != 0);
      state_.runner.RequestFrame(true);
    }
    WindowState& state_;
    std::size_t option_;
  };

  void AddButton(std::size_t option, int y, int width) { new Button(state_, option, y, width); }

  WindowState& state_;
  Fl_Scroll* list_;
};

FilterDialog::FilterDialog(WindowState& state) : state_(state) {}
FilterDialog::~FilterDialog() = default;

void FilterDialog::Toggle() {
  if (window_ && window_->shown()) return Close();
  Fl_Group::current(nullptr);
  window_ = std::make_unique<Window>(state_);
  window_->Fill();
  const Fl_Window& main = state_.world;
  window_->position(main.x_root() + main.w() + Window::kGap, main.y_root());
  window_->show();
}

void FilterDialog::Close() {
  if (window_) window_->hide();
}

void FilterDialog::Refresh() {
  if (window_ && window_->shown()) window_->Fill();
}

// ---- help and about -----------------------------------------------------------------------------

namespace {

constexpr char kHelp[] =
    R"(docs/window.md of the source tree has a table of all keys and of what the mouse does;
docs/properties.md explains every property of a world file, docs/ has more.

The menus show the keys of their items. Some keys:
  p      pause and continue        .      one step
  ]  [   faster, slower            {  }   real time, as fast as possible
  d      show sensor data          space  view from above
  r      perspective view          f      follow the selected robot
  Home   restart                   Each button beside the menus shows its key as well.

Mouse: drag a robot to move it, with the right button to turn it; drag anything
else to move the view, turn the wheel to zoom, press Ctrl and move to tilt.

The program's options:  stage --help
)";

std::string AboutText() {
  return std::string(
             "Stage 5 is an independent rewrite of Stage, the 2D multi-robot simulator. It "
             "is not a release by Stage's authors and contains nothing of their code. "
             "Stage was made by Richard Vaughan, Brian Gerkey, Andrew Howard and many "
             "contributors.\n\n") +
         COPYRIGHT + "\n\n" + LICENSE;
}

/// A window with read-only text. Opening it again shows the same window.
class TextWindow : public Fl_Window {
 public:
  TextWindow(int width, int height, const char* title, const std::string& text, int top, int bottom)
      : Fl_Window(width, height, title) {
    auto* display = new Fl_Text_Display(0, top, width, height - top - bottom);
    buffer_.text(text.c_str());
    display->buffer(buffer_);
    display->textsize(12);
    display->wrap_mode(Fl_Text_Display::WRAP_AT_BOUNDS, 0);
    resizable(display);
  }

 private:
  Fl_Text_Buffer buffer_;
};

void Hide(Fl_Widget*, void* window) { static_cast<Fl_Window*>(window)->hide(); }

}  // namespace

void ShowHelp() {
  Fl_Group::current(nullptr);
  static auto* window = [] {
    auto* made = new TextWindow(500, 270, "Getting help with Stage", kHelp, 0, 0);
    made->end();  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks)
    return made;
  }();
  window->show();
}

void ShowAbout() {
  constexpr int kWidth = 420, kHeight = 330, kMargin = 8, kBottom = 40;
  constexpr int kTop = Logo::kHeight + 2 * kMargin;
  Fl_Group::current(nullptr);
  static auto* window = [] {
    auto* made = new TextWindow(kWidth, kHeight, "About Stage", AboutText(), kTop, kBottom);
    new Logo((kWidth - Logo::kWidth) / 2, kMargin, std::string("Stage ") + Version());
    // The window owns the widgets created in it.
    auto* ok = new Fl_Return_Button(kWidth - 90, kHeight - 32, 80, 24, "OK");
    ok->callback(Hide, made);
    made->end();  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks)
    return made;
  }();
  window->show();
}

// ---- questions to the user ----------------------------------------------------------------------

namespace {

std::string Choose(const std::string& start, int type, const char* title, const char* ok) {
  Fl_File_Chooser chooser(start.c_str(), "World Files (*.world)", type, title);
  chooser.ok_label(ok);
  chooser.preview(0);
  chooser.show();
  while (chooser.shown()) Fl::wait();
  return chooser.value() ? chooser.value() : "";
}

}  // namespace

void Alert(const std::string& text) {
  fl_message_title("Stage");
  fl_alert("%s", text.c_str());
}

std::string ChooseFileToLoad(const std::string& present) {
  const size_t slash = present.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : present.substr(0, slash + 1);
  return Choose(folder, Fl_File_Chooser::SINGLE, "Load World", "Load");
}

std::string ChooseFileToSave(const std::string& suggested) {
  const char* home = std::getenv("HOME");
  std::string file =
      !suggested.empty() ? suggested : std::string(home ? home : ".") + "/my_scene.world";
  for (;;) {
    file = Choose(file, Fl_File_Chooser::CREATE, "Save World As", "Save");
    if (file.empty() || !std::filesystem::exists(file)) return file;
    fl_message_title("Save World As");
    // Esc selects the first button, Return the second.
    const int answer =
        fl_choice("%s exists. Replace it?", "Cancel", "Another name", "Replace", file.c_str());
    if (answer != 1) return answer == 2 ? file : "";
  }
}

std::string FreeNameBeside(const std::string& file) {
  if (file.empty()) return "";
  const std::filesystem::path path(file);
  for (int number = 1;; number++) {
    std::filesystem::path name = path;
    name.replace_filename(path.stem().string() + "-" + std::to_string(number) +
                          path.extension().string());
    if (!std::filesystem::exists(name)) return name.string();
  }
}

QuitAnswer AskBeforeQuitting() {
  fl_message_title("Quitting Stage");
  // Esc selects the first button, Return the second.
  switch (fl_choice("Quit without saving? The world file stays as it is.", "Cancel", "Quit",
                    "Save as, then quit")) {
    case 1:
      return QuitAnswer::kQuit;
    case 2:
      return QuitAnswer::kSave;
    default:
      return QuitAnswer::kCancel;
  }
}

}  // namespace Stg::internal::window
