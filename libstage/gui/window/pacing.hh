// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decides when the next step and the next frame are due, and measures the rate of both. Independent
// of the toolkit: callers pass times in seconds since a fixed moment.

#ifndef STAGE_GUI_WINDOW_PACING_HH
#define STAGE_GUI_WINDOW_PACING_HH

#include <deque>

#include "geometry/geometry.hh"

namespace Stg::internal::window {

/// Keeps steps at a fixed pace and catches up on late ones. After a long stop it drops the backlog,
/// because robots racing for minutes are of no use to the viewer.
class StepPacer {
 public:
  static constexpr double kMostArrears = 0.5;

  /// Real seconds between steps; 0 means as fast as possible.
  static double Period(usec_t sim_interval, double speedup) {
    return speedup > 0 ? static_cast<double>(sim_interval) / 1e6 / speedup : 0;
  }

  /// Makes the next step due one period from now.
  void Restart(double now, double period) { due_ = now + period; }
  /// Seconds until the next step; 0 or less if it is due.
  double UntilNext(double now, double period) const { return period > 0 ? due_ - now : 0; }
  /// True if a step is more than a period late, or if steps run as fast as possible: then steps
  /// need all the time.
  bool IsLate(double now, double period) const { return !(period > 0) || now - due_ > period; }
  void Stepped(double now, double period);

 private:
  double due_ = 0;
};

/// Limits the slowdown by drawing to a fifth. On-time steps need no limit. If steps are late, a
/// frame that took t seconds is followed by a rest of 7 t, so drawing gets an eighth of the time;
/// the window system's share is within the fifth.
class FrameBudget {
 public:
  static constexpr double kRest = 7;

  void Drawn(double start, double end);
  /// Earliest time of the next frame for the wanted interval.
  double Next(double interval, bool steps_are_late) const;
  double last_seconds() const { return seconds_; }

 private:
  double start_ = 0, end_ = 0;
  double seconds_ = 0;  // duration of the last frame
};

/// Ratio of simulated to real time over the last 20 steps or the last half second, whichever is
/// longer. Pauses do not count.
class SpeedMeter {
 public:
  /// Call when stepping begins or resumes.
  void Restart(double now, usec_t sim_time);
  void Stepped(double now, usec_t sim_time);
  /// 0 before the first measurement.
  double ratio() const { return ratio_; }
  void Clear();

 private:
  struct Moment {
    double real, simulated;
  };
  std::deque<Moment> moments_;
  double ratio_ = 0;
};

/// Events per second over the last second, or over the last two intervals if that is longer.
class RateMeter {
 public:
  void Note(double now);
  /// 0 before the first measurement.
  double rate() const { return rate_; }

 private:
  std::deque<double> times_;
  double rate_ = 0;
};

}  // namespace Stg::internal::window

#endif
