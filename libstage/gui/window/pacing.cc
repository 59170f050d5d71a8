// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/pacing.hh"

#include <algorithm>

namespace Stg::internal::window {

namespace {
constexpr size_t kSteps = 20;     // minimum number of steps to average over
constexpr double kSeconds = 0.5;  // minimum period to average over
}  // namespace

void FrameBudget::OnFrameDrawn(double start, double end) {
  start_ = start;
  end_ = end;
  seconds_ = end - start;
}

double FrameBudget::Next(double interval, bool steps_are_late) const {
  return std::max(start_ + interval, steps_are_late ? end_ + kRestFactor * seconds_ : end_);
}

void SpeedMeter::Restart(double now, usec_t sim_time) {
  moments_.assign(1, {now, static_cast<double>(sim_time) / 1e6});
}

void SpeedMeter::Clear() {
  moments_.clear();
  ratio_ = 0;
}

void SpeedMeter::Stepped(double now, usec_t sim_time) {
  moments_.push_back({now, static_cast<double>(sim_time) / 1e6});
  while (moments_.size() > kSteps + 1 && moments_[1].real <= now - kSeconds) moments_.pop_front();
  const Moment& first = moments_.front();
  if (moments_.size() > 2 && now > first.real)
    ratio_ = (moments_.back().simulated - first.simulated) / (now - first.real);
}

void RateMeter::Note(double now) {
  times_.push_back(now);
  while (times_.size() > 3 && times_[1] <= now - 1) times_.pop_front();
  const double span = now - times_.front();
  rate_ = times_.size() > 1 && span > 0 ? static_cast<double>(times_.size() - 1) / span : 0;
}

}  // namespace Stg::internal::window
