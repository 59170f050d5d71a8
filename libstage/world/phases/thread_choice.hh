// SPDX-License-Identifier: GPL-2.0-or-later
//
// Chooses whether a step uses one thread or all, if the user set no number. Results are equal.
//
// Threads speed up large steps, but slow down small ones and take processors from other processes.
// Steps start with one thread; only if they last long enough are threads started. From then on both
// are measured, as in the choice between device and host (PathChooser): all threads stand for the
// device, models for rays.

#ifndef STAGE_WORLD_PHASES_THREAD_CHOICE_HH
#define STAGE_WORLD_PHASES_THREAD_CHOICE_HH

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

#include "sensing/path_chooser.hh"

namespace Stg {

class ThreadChoice {
 public:
  /// Seconds. For shorter steps, waking threads does not pay: it takes 10 to 40 microseconds per
  /// thread.
  static constexpr double kWorthThreads = 100e-6;

  /// Whether the next step, in which `models` models update or move, should use all threads.
  bool UseAll(size_t models) {
    size_ = std::min(static_cast<size_t>(std::bit_width(models)), kSizes - 1);
    measures_ = alone_[size_].typical >= kWorthThreads;
    uses_all_ = measures_ && chooser_.UseDevice(models);
    return uses_all_;
  }
  /// Records the duration of the step chosen last, including rays, in seconds.
  void Report(double seconds) {
    if (measures_) chooser_.Report(seconds);
    if (!uses_all_) alone_[size_].Note(seconds);
  }

 private:
  /// Durations of steps on one thread, in seconds.
  struct Alone {
    double last = 0;
    double typical = 0;  // minimum of the last two; 0 before the second

    void Note(double seconds) {
      typical = std::min(last, seconds);
      last = seconds;
    }
  };
  // Steps are grouped by powers of two, as in PathChooser, because sensors with different update
  // intervals make steps of different sizes.
  static constexpr size_t kSizes = 33;

  internal::sensing::PathChooser chooser_;
  std::array<Alone, kSizes> alone_;
  size_t size_ = 0;  // size group of this step
  bool measures_ = false, uses_all_ = false;
};

}  // namespace Stg

#endif
