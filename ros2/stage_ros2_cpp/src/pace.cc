// SPDX-License-Identifier: GPL-2.0-or-later

#include "pace.hh"

#include <algorithm>
#include <cmath>

namespace stage_ros2_cpp {

namespace {
/// Max delay in real time that the world catches up, seconds. Longer delays make it slower.
constexpr double kMaxDelay = 0.05;
}  // namespace

bool Pace::IsUnlimited() const { return speed_ == 0 || std::isinf(speed_); }

void Pace::Begin() {
  due_ = 0;
  counted_ = Clock::now();
}

void Pace::Count() {
  const Clock::time_point now = Clock::now();
  if (running_ && !IsUnlimited())
    due_ += std::chrono::duration<double>(now - counted_).count() * speed_;
  counted_ = now;
}

void Pace::SetSpeed(double speed) {
  Count();
  speed_ = speed;
}

void Pace::SetRunning(bool running) {
  Count();
  running_ = running;
}

bool Pace::IsDue(double dt) {
  if (!running_ || IsUnlimited()) return running_;
  Count();
  due_ = std::min(due_, kMaxDelay * speed_ + dt);
  return due_ / dt + 1e-9 >= 1;
}

void Pace::Made(double dt) {
  if (!IsUnlimited()) due_ -= dt;
}

}  // namespace stage_ros2_cpp
