// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps and pictures by the timers of FLTK's event loop.

#ifndef STAGE_GUI_WINDOW_RUNNER_HH
#define STAGE_GUI_WINDOW_RUNNER_HH

#include <FL/Fl.H>
#include <FL/Fl_Widget.H>

#include "gui/window/pacing.hh"
#include "world/world.hh"

namespace Stg::internal::window {

/// Seconds since some fixed moment.
double Now();

/// Steps a world while it is not paused, and has its canvas drawn when something has changed and
/// there is time for it.
class Runner {
 public:
  Runner(World& world, Fl_Widget& canvas);
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// The wanted time between pictures, seconds.
  void SetInterval(double seconds) { interval_ = seconds; }

  /// To be called when World::paused or World::speedup have changed.
  void Reschedule();
  /// From now on, steps come whenever the world is not paused; before, never.
  void Begin();
  bool has_begun() const { return begun_; }
  /// To be called at the end of each step, whoever made it.
  void Stepped();
  /// The world is another one: no steps until Begin().
  void Halt();

  /// Something is to be seen; there will be a picture soon. `soon`: somebody waits for it, so that
  /// the interval does not count.
  void WantFrame(bool soon = false);
  /// A picture was made.
  void Drawn(double start, double end);

  const SpeedMeter& speed() const { return speed_; }
  double frames_per_second() const { return frames_.rate(); }
  const FrameBudget& budget() const { return budget_; }

 private:
  static void OnStep(void* runner) { static_cast<Runner*>(runner)->Pump(); }
  static void OnFrame(void* runner);
  static void OnWatch(void* runner);
  double Period() const { return StepPacer::Period(world_.sim_interval, world_.speedup); }
  void Pump();
  void Schedule(double now);
  void Unschedule();

  World& world_;
  Fl_Widget& canvas_;
  StepPacer pacer_;
  SpeedMeter speed_;
  FrameBudget budget_;
  RateMeter frames_;
  double interval_ = 0.04;
  bool begun_ = false;            // see Begin()
  bool running_ = false;          // steps are scheduled
  bool idle_ = false;             // by the idle callback, otherwise by a timer
  bool pumping_ = false;          // a step may run the event loop itself
  bool frame_scheduled_ = false;  // there will be a picture, by a timer or at the next occasion
  uint64_t drawn_updates_ = 0;    // of the world, when the last picture was made
};

}  // namespace Stg::internal::window

#endif
