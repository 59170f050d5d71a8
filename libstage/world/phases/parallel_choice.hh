// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decides whether threads share the updates, moves and callbacks of a step. Results do not depend
// on it.
//
// In small steps sharing may cost more than it saves, because models must move between the caches
// of threads. The choice is measured like that between device and host (PathChooser): threads stand
// for the device, models for rays.

#ifndef STAGE_WORLD_PHASES_PARALLEL_CHOICE_HH
#define STAGE_WORLD_PHASES_PARALLEL_CHOICE_HH

#include <cstddef>

#include "sensing/path_chooser.hh"

namespace Stg {

class ParallelChoice {
 public:
  /// See RunOptions::share_from. With 1, threads always share.
  void SetMinLength(size_t models) { chooser_ = sensing::PathChooser(models == 1); }

  /// Chooses for a step in which `models` models update or move.
  void Choose(unsigned threads, size_t models) {
    // Longer steps always gain from sharing; measuring them alone would only cost time.
    constexpr double kSmallStep = 0.5e-3;
    measures_ = threads > 1 && seconds_ < kSmallStep;
    is_parallel_ = !measures_ || chooser_.UseDevice(models);
  }
  bool is_parallel() const { return is_parallel_; }
  /// Reports the seconds that updates, moves and callbacks took, without rays.
  void Report(double seconds) {
    if (measures_) chooser_.Report(seconds);
    if (is_parallel_) seconds_ = seconds;
  }

 private:
  sensing::PathChooser chooser_;
  bool is_parallel_ = true;  // in this step
  bool measures_ = false;    // in this step
  double seconds_ = 1;       // duration of the last shared step
};

}  // namespace Stg

#endif
