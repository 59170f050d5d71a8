// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decides when the next step of a world with a speedup is due.

#ifndef STAGE_WORLD_STEP_PACER_HH
#define STAGE_WORLD_STEP_PACER_HH

#include <algorithm>

#include "geometry/geometry.hh"

namespace Stg {

/// Keeps steps at a fixed pace and catches up on late ones. After a long stop it drops the backlog,
/// because robots racing for minutes are of no use to the viewer. Times are seconds since a fixed
/// moment, such as those of threads::WallClock().
class StepPacer {
 public:
  /// Real seconds between steps; 0 means as fast as possible.
  static double Period(usec_t sim_interval, double speedup) {
    return speedup > 0 ? static_cast<double>(sim_interval) / 1e6 / speedup : 0;
  }

  bool has_begun() const { return due_ >= 0; }
  /// Makes the next step due one period from now.
  void Restart(double now, double period) { due_ = now + period; }
  /// Seconds until the next step; 0 or less if it is due.
  double UntilNext(double now, double period) const { return period > 0 ? due_ - now : 0; }
  /// True if a step is more than a period late, or if steps run as fast as possible: then steps
  /// need all the time.
  bool IsLate(double now, double period) const { return !(period > 0) || now - due_ > period; }
  /// Makes the next step due one period after the last one was.
  void Stepped(double now, double period) { due_ = std::max(due_ + period, now - kMaxBacklog); }

 private:
  static constexpr double kMaxBacklog = 0.5;

  double due_ = -1;
};

}  // namespace Stg

#endif
