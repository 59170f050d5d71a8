// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decides whether threads share the updates, moves and callbacks of a step. The outcome is the
// same.
//
// In small steps sharing may cost more than it saves, if only because threads leave models in their
// caches for others to fetch. It is measured like the choice between device and host: the threads
// stand for the device, models for rays.

#ifndef STAGE_WORLD_PHASES_SHARING_HH
#define STAGE_WORLD_PHASES_SHARING_HH

#include <cstddef>

#include "sensing/path_chooser.hh"

namespace Stg {

class Sharing {
 public:
  /// See RunOptions::share_from. 1: always.
  void SetFewest(size_t models) { chooser_ = sensing::PathChooser(models == 1); }

  /// For a step in which so many models update or move.
  void Choose(unsigned threads, size_t models) {
    // Larger steps are worth sharing, and not worth trying without.
    constexpr double kSmallStep = 0.5e-3;
    compares_ = threads > 1 && seconds_ < kSmallStep;
    shares_ = !compares_ || chooser_.UseDevice(models);
  }
  bool shares() const { return shares_; }
  /// What updates, moves and callbacks took, rays left out.
  void Report(double seconds) {
    if (compares_) chooser_.Report(seconds);
    if (shares_) seconds_ = seconds;
  }

 private:
  sensing::PathChooser chooser_;
  bool shares_ = true;     // in this step
  bool compares_ = false;  // in this step
  double seconds_ = 1;     // what the last step took that was shared
};

}  // namespace Stg

#endif
