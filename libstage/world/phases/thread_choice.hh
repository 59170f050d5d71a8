// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decides how many threads a step uses where nobody has said so: one, or all. Results are the same.
//
// Threads help large steps. They cost small ones more than they save, and take processors from
// other processes for nothing. Steps are taken alone first: only if they last long enough, threads
// are started at all. From then on it is measured which is faster, like the choice between device
// and host: all threads stand for the device, models for rays.

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
  /// Seconds. A step that takes less on one thread is not worth waking others for: that takes some
  /// 10 to 40 microseconds a thread.
  static constexpr double kWorthThreads = 100e-6;

  /// Whether all threads are to take the next step, in which so many models update or move.
  bool UseAll(size_t models) {
    size_ = std::min(static_cast<size_t>(std::bit_width(models)), kSizes - 1);
    compares_ = alone_[size_].typical >= kWorthThreads;
    uses_all_ = compares_ && chooser_.UseDevice(models);
    return uses_all_;
  }
  /// Learns how long the step took that was asked for last, rays included.
  void Report(double seconds) {
    if (compares_) chooser_.Report(seconds);
    if (!uses_all_) alone_[size_].Note(seconds);
  }

 private:
  /// Seconds that steps take on one thread.
  struct Alone {
    double last = 0;
    double typical = 0;  // the lesser of the last two; 0 if there were fewer

    void Note(double seconds) {
      typical = std::min(last, seconds);
      last = seconds;
    }
  };
  // Sizes are the same within a factor of two, as in PathChooser: sensors that are read at
  // different intervals make steps of different sizes.
  static constexpr size_t kSizes = 33;

  internal::sensing::PathChooser chooser_;
  std::array<Alone, kSizes> alone_;
  size_t size_ = 0;  // of this step
  bool compares_ = false, uses_all_ = false;
};

}  // namespace Stg

#endif
