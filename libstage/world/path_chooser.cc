// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/path_chooser.hh"

#include <algorithm>

namespace Stg {

namespace {
constexpr uint64_t kWarmUps = 2;         // the first runs of a path are slower: not counted
constexpr double kSmoothing = 0.25;      // weight of the newest measurement
constexpr uint64_t kLongestWait = 2048;  // batches between looks at the slower path
}  // namespace

bool PathChooser::UseDevice(uint64_t rays) {
  rays_ = rays;
  batches_++;
  if (always_) return device_chosen_ = true;
  if (device_.tries <= kWarmUps) return device_chosen_ = true;
  if (host_.tries <= kWarmUps) return device_chosen_ = false;
  device_chosen_ = device_.cost < host_.cost;
  if (batches_ >= next_look_) {
    // The scene changes: look at the other path now and then, ever more rarely, and the sooner the
    // closer they are.
    const double ratio = std::max(device_.cost, host_.cost) / std::min(device_.cost, host_.cost);
    look_after_ = std::min(kLongestWait, look_after_ * 2);
    next_look_ = batches_ + (ratio < 1.5 ? look_after_ / 2 : look_after_);
    device_chosen_ = !device_chosen_;
  }
  return device_chosen_;
}

void PathChooser::Report(double seconds) {
  Path& path = device_chosen_ ? device_ : host_;
  if (path.tries++ < kWarmUps || rays_ == 0) return;
  const double cost = seconds / static_cast<double>(rays_);
  path.cost = path.cost < 0 ? cost : path.cost + kSmoothing * (cost - path.cost);
}

}  // namespace Stg
