// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/timeline.hh"

#include <FL/Fl.H>
#include <FL/Fl_Hor_Nice_Slider.H>
#include <FL/fl_draw.H>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "gui/window/window_state.hh"

namespace Stg::internal::window {

namespace {

constexpr int kGap = 6, kFontSize = 12, kTimeWidth = 120, kWidestName = 240;
constexpr double kKeyStep = 0.1;  // seconds per arrow key

Fl_Box* AddText(int x, int y, int width, const std::string& text, Fl_Align align) {
  auto* box = new Fl_Box(x, y, width, Timeline::kHeight);
  box->copy_label(text.c_str());
  box->labelsize(kFontSize);
  box->align(align | FL_ALIGN_INSIDE | FL_ALIGN_CLIP);
  return box;
}

int WidthOf(const std::string& text) {
  fl_font(FL_HELVETICA, kFontSize);
  return static_cast<int>(std::ceil(fl_width(text.c_str()))) + 2 * kGap;
}

}  // namespace

std::string TimeText(double seconds) {
  const double tenths = std::round(std::max(0.0, seconds) * 10);
  char text[64];
  std::snprintf(text, sizeof text, "%.0f:%04.1f", std::floor(tenths / 600),
                std::fmod(tenths, 600) / 10);
  return text;
}

Timeline::Timeline(WindowState& state, ReplayedLog log, int y, int width)
    : state_(state), log_(std::move(log)) {
  row_ = new Fl_Group(0, y, width, kHeight);
  row_->box(FL_UP_BOX);
  const int name_width = std::min(WidthOf(log_.name), kWidestName);
  AddText(kGap, y, name_width, log_.name, FL_ALIGN_LEFT)->tooltip("The replayed log");
  const int left = kGap + name_width, right = std::max(left + 1, width - kTimeWidth - kGap);
  slider_ = new Fl_Hor_Nice_Slider(left, y + 4, right - left, kHeight - 8);
  slider_->box(FL_FLAT_BOX);
  slider_->color(fl_rgb_color(210, 214, 226));
  slider_->selection_color(fl_rgb_color(40, 45, 60));
  slider_->bounds(log_.start, std::max(log_.end, log_.start + 1e-3));
  slider_->step(kKeyStep);
  slider_->tooltip("Drag to another time. < and > skip ten seconds, Home goes to the start");
  slider_->callback(
      [](Fl_Widget*, void* self) {
        auto* timeline = static_cast<Timeline*>(self);
        timeline->SeekTo(timeline->slider_->value());
        if (Fl::event() == FL_RELEASE) timeline->state_.canvas->take_focus();
      },
      this);
  slider_->when(FL_WHEN_CHANGED | FL_WHEN_RELEASE_ALWAYS);
  time_ = AddText(right + kGap, y, kTimeWidth - kGap, "", FL_ALIGN_RIGHT);
  row_->resizable(slider_);
  row_->end();
  Refresh(log_.start);
}

void Timeline::Refresh(double now) {
  const std::string text = TimeText(now) + " / " + TimeText(log_.end);
  if (!time_->label() || text != time_->label()) {
    time_->copy_label(text.c_str());
    row_->redraw();
  }
  if (Fl::pushed() != slider_) slider_->value(std::clamp(now, log_.start, log_.end));
}

void Timeline::Skip(double seconds) {
  SeekTo(static_cast<double>(state_.world.SimTimeNow()) / 1e6 + seconds);
}

void Timeline::SeekTo(double seconds) {
  log_.seek_to(std::clamp(seconds, log_.start, log_.end));
  state_.world.Redraw();
}

}  // namespace Stg::internal::window
