// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/path_chooser.hh"

#include <algorithm>

namespace Stg {

namespace {
constexpr uint64_t kLook = 3;            // batches of a look
constexpr double kShareOfLooks = 0.005;  // looks may cost this share of the time
constexpr uint64_t kShortestWait = 64;   // batches between looks
constexpr uint64_t kSoon = 16;
constexpr uint64_t kFirstLook = 4;
constexpr uint64_t kLongestWait = 20000;
}  // namespace

void PathChooser::Cost::Note(double seconds_per_ray) {
  if (tries_++ < warm_ups_) return;
  const uint64_t noted = tries_ - warm_ups_;
  last_[(noted - 1) % kKept] = seconds_per_ray;
  double sorted[kKept];
  const uint64_t count = std::min(noted, kKept), middle = (count - 1) / 2;
  std::copy_n(last_, count, sorted);
  std::nth_element(sorted, sorted + middle, sorted + count);
  typical_ = sorted[middle];
}

bool PathChooser::UseDevice(uint64_t rays) {
  rays_ = rays;
  batches_++;
  const bool was_device = device_chosen_;
  device_chosen_ = Choose(rays);
  catches_up_ = device_chosen_ && !was_device;
  is_look_ = !always_ && (!host_.known() || device_chosen_ != device_faster_);
  return device_chosen_;
}

bool PathChooser::Choose(uint64_t rays) {
  if (always_ || !device_.known()) return true;
  if (!host_.known()) return false;
  if (rays_at_look_ == 0) BeginToCompare();
  if (look_batches_ > 0 && LookIsClear()) look_batches_ = 0;
  if (look_batches_ > 0) {
    look_batches_--;
    return device_chosen_;
  }
  const bool device_faster = device_.typical() < host_.typical();
  if (device_faster != device_faster_) {
    // A change of mind may be due to a bad moment: it is looked into soon.
    device_faster_ = device_faster;
    next_look_ = std::min(next_look_, batches_ + kSoon);
  }
  if (!NeedsLook(rays)) return device_faster;
  rays_at_look_ = rays;
  ScheduleLook();
  look_batches_ = device_faster ? kLook - 1 : kLook;  // the device has to catch up first
  return !device_faster;
}

/// Both are known by a single batch each. One that was interrupted may have taken many times as
/// long: if that could have turned the outcome, there is a look at once.
void PathChooser::BeginToCompare() {
  constexpr double kInterrupted = 30;
  rays_at_look_ = rays_;
  device_faster_ = device_.typical() < host_.typical();
  ScheduleLook();
  if (TimesSlower() < kInterrupted) next_look_ = batches_ + kFirstLook;
}

double PathChooser::TimesSlower() const {
  const double device = device_.typical(), host = host_.typical();
  return std::max(device, host) / std::min(device, host);
}

/// The scene changes: the other path is looked at now and then, and at once if the batches have
/// become much larger or smaller.
bool PathChooser::NeedsLook(uint64_t rays) const {
  return batches_ >= next_look_ || rays > 2 * rays_at_look_ || 2 * rays < rays_at_look_;
}

bool PathChooser::LookIsClear() const {
  constexpr double kClearly = 1.5;
  return last_cost_ > kClearly * (device_chosen_ ? host_ : device_).typical();
}

/// The more a look costs, the more rarely: before it or after it, the device has to catch up.
void PathChooser::ScheduleLook() {
  const double faster = std::min(device_.typical(), host_.typical());
  const double catching_up = std::max(catching_up_.typical() / faster - 1, 0.0);
  const double lost = static_cast<double>(kLook) * (TimesSlower() - 1) + catching_up;  // batches
  const double wait = std::min(lost / kShareOfLooks, static_cast<double>(kLongestWait));
  next_look_ = batches_ + std::max(kShortestWait, static_cast<uint64_t>(wait));
}

void PathChooser::Report(double seconds, uint64_t rays) {
  if (rays == 0) return;
  const double cost = seconds / static_cast<double>(rays);
  last_cost_ = catches_up_ ? 0 : cost;
  (catches_up_ ? catching_up_ : device_chosen_ ? device_ : host_).Note(cost);
}

}  // namespace Stg
