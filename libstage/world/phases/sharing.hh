// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decides whether threads share the updates, moves and callbacks of a step. Results do not depend
// on it.
//
// In small steps sharing may cost more than it saves, because models must move between the caches
// of threads. The choice is measured like that between device and host (PathChooser): threads stand
// for the device, models for rays.

#ifndef STAGE_WORLD_PHASES_SHARING_HH
#define STAGE_WORLD_PHASES_SHARING_HH

#include <cstddef>

#include "sensing/path_chooser.hh"

namespace Stg {

class Sharing {
 public:
  /// See RunOptions::share_from. With 1, threads always share.
  void SetFewest(size_t models) { chooser_ = sensing::PathChooser(models == 1); }

  /// Chooses for a step in which `models` models update or move.
  void Choose(unsigned threads, size_t models) {
    // Longer steps always gain from sharing; measuring them alone would only cost time.
    constexpr double kSmallStep = 0.5e-3;
    compares_ = threads > 1 && seconds_ < kSmallStep;
    shares_ = !compares_ || chooser_.UseDevice(models);
  }
  bool shares() const { return shares_; }
  /// Reports the seconds that updates, moves and callbacks took, without rays.
  void Report(double seconds) {
    if (compares_) chooser_.Report(seconds);
    if (shares_) seconds_ = seconds;
  }

 private:
  sensing::PathChooser chooser_;
  bool shares_ = true;     // in this step
  bool compares_ = false;  // in this step
  double seconds_ = 1;     // duration of the last shared step
};

}  // namespace Stg

#endif
