// SPDX-License-Identifier: GPL-2.0-or-later
//
// When the next step is due, when the next picture is, and how fast both come. No toolkit: times
// are seconds since some fixed moment, handed in.

#ifndef STAGE_GUI_WINDOW_PACING_HH
#define STAGE_GUI_WINDOW_PACING_HH

#include <deque>

#include "geometry/geometry.hh"

namespace Stg::internal::window {

/// Keeps steps to a pace. Late steps are caught up with, but not after a long stop: robots that
/// race for minutes to make up for it are no use to anybody who watches.
class StepPacer {
 public:
  static constexpr double kMostArrears = 0.5;

  /// Real seconds between two steps; 0: as fast as possible.
  static double Period(usec_t sim_interval, double speedup) {
    return speedup > 0 ? static_cast<double>(sim_interval) / 1e6 / speedup : 0;
  }

  /// The next step comes one period from now.
  void Restart(double now, double period) { due_ = now + period; }
  /// Until the next step; 0 or less: it is due.
  double UntilNext(double now, double period) const { return period > 0 ? due_ - now : 0; }
  /// More than a step late, or never waiting: all time is needed for steps.
  bool IsLate(double now, double period) const { return !(period > 0) || now - due_ > period; }
  void Stepped(double now, double period);

 private:
  double due_ = 0;
};

/// Pictures must not slow the simulation down by more than a fifth. As long as steps are in time
/// nothing needs to be held back; if they are late, a picture that took t seconds is followed by
/// seven times t without one: drawing has an eighth of the time, and what the window system takes
/// beside it comes out of the rest of that fifth.
class FrameBudget {
 public:
  static constexpr double kRest = 7;

  void Drawn(double start, double end);
  /// The earliest time for the next picture, given the wanted interval.
  double Next(double interval, bool steps_are_late) const;
  double last_seconds() const { return seconds_; }

 private:
  double start_ = 0, end_ = 0;
  double seconds_ = 0;  // that the last one took
};

/// Simulated by real time, over the last 20 steps or the last half second, whichever is longer.
/// Pauses do not count.
class SpeedMeter {
 public:
  /// Steps begin, or go on after a pause.
  void Restart(double now, usec_t sim_time);
  void Stepped(double now, usec_t sim_time);
  /// 0: not measured yet.
  double ratio() const { return ratio_; }
  void Clear();

 private:
  struct Moment {
    double real, simulated;
  };
  std::deque<Moment> moments_;
  double ratio_ = 0;
};

/// Events per second, over the last second or the last two events.
class RateMeter {
 public:
  void Note(double now);
  /// 0: nothing to be seen.
  double rate() const { return rate_; }

 private:
  std::deque<double> times_;
  double rate_ = 0;
};

}  // namespace Stg::internal::window

#endif
