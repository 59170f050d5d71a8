// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decides when the next frame is due, and measures the rates of steps and frames. Independent
// of the toolkit: callers pass times in seconds since a fixed moment.

#ifndef STAGE_GUI_WINDOW_PACING_HH
#define STAGE_GUI_WINDOW_PACING_HH

#include <deque>

#include "geometry/geometry.hh"

namespace Stg::internal::window {

/// Limits the slowdown by drawing to a fifth. On-time steps need no limit. If steps are late, a
/// frame that took t seconds is followed by a rest of 7 t, so drawing gets an eighth of the time;
/// the window system's share is within the fifth.
class FrameBudget {
 public:
  static constexpr double kRestFactor = 7;

  void OnFrameDrawn(double start, double end);
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
