// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/toolbar.hh"

#include <FL/Fl.H>
#include <FL/Fl_Box.H>
#include <FL/Fl_Group.H>
#include <FL/fl_draw.H>

#include <algorithm>
#include <cstdio>

#include "gui/window/window_state.hh"

namespace Stg::internal::window {

namespace {

constexpr int kMenuWidth = 172, kGap = 3, kButtonWidth = 28, kSpeedWidth = 68;
constexpr int kFontSize = 12;
constexpr double kSpeeds[] = {0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100};
constexpr char kRun[] = "@>", kPause[] = "@stage_pause", kStep[] = "@>|", kRestart[] = "@|<";

/// Draws two separate bars; those of FLTK's symbol merge at this size.
void DrawPause(Fl_Color color) {
  fl_color(color);
  for (const double left : {-0.6, 0.15}) {
    fl_begin_polygon();
    fl_vertex(left, -0.7);
    fl_vertex(left + 0.45, -0.7);
    fl_vertex(left + 0.45, 0.7);
    fl_vertex(left, 0.7);
    fl_end_polygon();
  }
}

}  // namespace

std::string SpeedText(double speedup) {
  if (!(speedup > 0)) return "max";
  char text[32];
  std::snprintf(text, sizeof text, "%.2g \u00d7", speedup);
  if (speedup >= 10) std::snprintf(text, sizeof text, "%.0f \u00d7", speedup);
  return text;
}

Toolbar::Toolbar(WindowState& state, Fl_Widget* menu_bar, int width, int height) : state_(state) {
  fl_add_symbol("stage_pause", DrawPause, 1);
  auto* row = new Fl_Group(0, 0, width, height);
  row->box(FL_UP_BOX);
  row->add(menu_bar);
  menu_bar->resize(2, 2, kMenuWidth, height - 4);
  menu_bar->box(FL_FLAT_BOX);
  x_ = kMenuWidth + 4 * kGap;
  run_ = AddButton(kRun, "Run (p)", [this] { state_.TogglePause(); });
  step_ = AddButton(kStep, "One step (.)", [this] { state_.OneStep(); });
  restart_ = AddButton(kRestart, "Restart (Home)", [this] { state_.Restart(); });
  AddSpeeds();
  auto* rest = new Fl_Box(x_, 0, std::max(1, width - x_), height);
  row->resizable(rest);
  row->end();
}

Fl_Button* Toolbar::AddButton(const char* symbol, const char* tooltip,
                              std::function<void()> action) {
  auto* button = new Fl_Button(x_, kGap, kButtonWidth, view::ViewState::kMenuHeight - 2 * kGap);
  x_ += kButtonWidth + kGap;
  button->label(symbol);
  button->labelcolor(fl_rgb_color(40, 45, 60));
  button->box(FL_THIN_UP_BOX);
  button->tooltip(tooltip);
  actions_.emplace_back([this, act = std::move(action)] { Act(act); });
  button->callback(Call, &actions_.back());
  return button;
}

void Toolbar::AddSpeeds() {
  x_ += kGap;
  speed_ = new Fl_Menu_Button(x_, kGap, kSpeedWidth, view::ViewState::kMenuHeight - 2 * kGap);
  x_ += kSpeedWidth + kGap;
  speed_->box(FL_THIN_UP_BOX);
  speed_->labelsize(kFontSize);
  speed_->textsize(kFontSize);
  speed_->tooltip(
      "Speed, as multiple of real time\n"
      "slower [   faster ]   real time {   as fast as possible }");
  const auto add = [this](const std::string& text, double speedup) {
    actions_.emplace_back([this, speedup] { Act([&] { state_.SetSpeed(speedup); }); });
    speed_->add(text.c_str(), 0, Call, &actions_.back());
  };
  for (const double speedup : kSpeeds)
    add(SpeedText(speedup) + (speedup == 1 ? "  real time" : ""), speedup);
  add("max  as fast as possible", -1);
}

/// Runs an action and returns the focus to the canvas after a click; otherwise the space bar would
/// press the button again. A user who reached the button with Tab stays there.
void Toolbar::Act(const std::function<void()>& action) {
  const bool by_key = Fl::event() == FL_KEYBOARD || Fl::event() == FL_SHORTCUT;
  action();
  if (!by_key) state_.canvas->take_focus();
}

void Toolbar::Refresh() {
  const bool shows_pause = !state_.world.paused && state_.runner.has_begun();
  if (shows_pause != shows_pause_) {
    shows_pause_ = shows_pause;
    run_->label(shows_pause ? kPause : kRun);
    run_->tooltip(shows_pause ? "Pause (p)" : "Run (p)");
    run_->redraw();
  }
  const double speedup = std::max(0.0, state_.world.speedup);
  if (speedup != shown_speed_ || !speed_->label()) {
    shown_speed_ = speedup;
    speed_->copy_label(SpeedText(speedup).c_str());
  }
}

}  // namespace Stg::internal::window
