// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/path_chooser.hh"

#include <algorithm>

#include "messages/assert.hh"

namespace Stg::internal::sensing {

namespace {
constexpr uint64_t kProbeBatches = 3;
constexpr double kProbeFraction = 0.005;             // fraction of the time that probes may cost
constexpr double kNoise = 0.1;                       // relative noise of costs
constexpr double kClearRatio = 1.5;                  // ratio of costs that is beyond doubt
constexpr uint64_t kMinWait = 16, kMaxWait = 20000;  // limits of Wait(), in batches
// A large change may be a disturbance. Early probes check it after 4, 32, 256 ... batches.
constexpr uint64_t kFirstWait = 4;
constexpr int kEarlyProbes = 4;
}  // namespace

void PathComparison::Cost::Note(double seconds_per_ray) {
  STAGE_ASSERT(seconds_per_ray >= 0);
  if (tries_++ < warm_ups_) return;
  const uint64_t noted = tries_ - warm_ups_;
  last_[(noted - 1) % kKept] = seconds_per_ray;
  double sorted[kKept];
  const uint64_t count = std::min(noted, kKept), middle = (count - 1) / 2;
  std::copy_n(last_, count, sorted);
  std::nth_element(sorted, sorted + middle, sorted + count);
  typical_ = sorted[middle];
}

bool PathComparison::UseDevice() {
  batches_++;
  const bool was_device = device_chosen_;
  device_chosen_ = Choose();
  catches_up_ = device_chosen_ && !was_device;
  is_probe_ = !host_.known() || device_chosen_ != device_faster_;
  return device_chosen_;
}

bool PathComparison::Choose() {
  if (!device_.known()) return true;
  if (!host_.known()) return false;
  if (!both_known_) {
    BeginToCompare();
  } else if (is_probe_) {  // the previous batch
    if (probe_batches_ > 0 && !ProbeIsClear()) {
      probe_batches_--;
      return device_chosen_;
    }
    EndProbe();
  }
  seems_slower_ = CostRatio() * (1 + kNoise) < 1 ? seems_slower_ + 1 : 0;
  if (seems_slower_ == kMinWait) wait_ = std::min(wait_, Wait());  // too long for noise
  if (batches_ < last_probe_ + wait_) return device_faster_;
  probe_batches_ =
      device_faster_ ? kProbeBatches - 1 : kProbeBatches;  // the device must catch up first
  return !device_faster_;
}

/// Each path has been measured by a single batch, which may have been interrupted and taken many
/// times as long. Early probes follow unless even that could not change the outcome.
void PathComparison::BeginToCompare() {
  constexpr double kInterrupted = 30;
  both_known_ = true;
  device_faster_ = device_.typical() < host_.typical();
  last_probe_ = batches_;
  early_probes_ = CostRatio() < kInterrupted ? kEarlyProbes : 0;
  wait_ = Wait();
}

/// Changes the path only here: between probes, the data on the other path are old.
void PathComparison::EndProbe() {
  last_probe_ = batches_;
  early_probes_ = CostRatio() * kClearRatio < 1 ? kEarlyProbes : std::max(early_probes_ - 1, 0);
  if (CostRatio() < 1) device_faster_ = !device_faster_;
  wait_ = Wait();
}

/// Ratio of the unused path's cost to that of the path in use; below 1 if it seems faster.
double PathComparison::CostRatio() const {
  const double times = device_.typical() / host_.typical();
  return device_faster_ ? 1 / times : times;
}

bool PathComparison::ProbeIsClear() const {
  return last_cost_ > kClearRatio * (device_chosen_ ? host_ : device_).typical();
}

/// Number of batches until the next probe. It grows with the cost of a probe (some batches on the
/// other path, and the device catching up) and shrinks with the possible gain.
uint64_t PathComparison::Wait() const {
  const double cost_ratio = CostRatio();
  const double used = (device_faster_ ? device_ : host_).typical();
  const double catching_up = std::max(catching_up_.typical() / used - 1, 0.0);
  const double lost =
      static_cast<double>(kProbeBatches) * std::max(cost_ratio - 1, 0.0) + catching_up;
  const double missed = std::max(1 / cost_ratio - 1, 0.0);
  const double wait = std::min(lost / (kProbeFraction + missed), static_cast<double>(kMaxWait));
  const uint64_t max_wait =
      early_probes_ > 0 ? kFirstWait << 3 * (kEarlyProbes - early_probes_) : kMaxWait;
  return std::min(max_wait, std::max(kMinWait, static_cast<uint64_t>(wait)));
}

void PathComparison::Report(double seconds_per_ray) {
  last_cost_ = catches_up_ ? 0 : seconds_per_ray;
  (catches_up_ ? catching_up_ : device_chosen_ ? device_ : host_).Note(seconds_per_ray);
}

bool PathChooser::UseDevice(uint64_t rays) {
  rays_ = rays;
  return always_ || (rays > 0 && comparisons_[Size()].UseDevice());
}

void PathChooser::Report(double seconds, uint64_t rays) {
  if (rays > 0) comparisons_[Size()].Report(seconds / static_cast<double>(rays));
}

}  // namespace Stg::internal::sensing
