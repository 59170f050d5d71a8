// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drives steps and frames with the timers of FLTK's event loop.

#ifndef STAGE_GUI_WINDOW_RUNNER_HH
#define STAGE_GUI_WINDOW_RUNNER_HH

#include <FL/Fl.H>
#include <FL/Fl_Widget.H>

#include "gui/window/pacing.hh"
#include "world/step_pacer.hh"
#include "world/world.hh"

namespace Stg::internal::window {

/// Steps a world while it is not paused. Redraws its canvas when something has changed and time
/// permits.
class Runner {
 public:
  Runner(World& world, Fl_Widget& canvas);
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// Wanted time between frames, seconds.
  void SetInterval(double seconds) { interval_ = seconds; }

  /// Call when World::paused or World::speedup has changed.
  void Reschedule();
  /// Enables stepping: until then no steps run, and then they run whenever the world is not paused.
  void Begin();
  bool has_begun() const { return stepping_enabled_; }
  /// Call at the end of each step, whether or not the runner made it.
  void Stepped();
  /// Stops stepping until Begin(), because another world is being loaded.
  void Halt();

  /// Requests a frame. `soon`: a user waits for it, so the interval is ignored.
  void RequestFrame(bool soon = false);
  /// Call after a frame was drawn.
  void OnFrameDrawn(double start, double end);

  const SpeedMeter& speed() const { return speed_; }
  double frames_per_second() const { return frames_.rate(); }
  const FrameBudget& budget() const { return budget_; }

 private:
  static void OnStep(void* runner) { static_cast<Runner*>(runner)->RunSteps(); }
  static void OnFrame(void* runner);
  static void OnPoll(void* runner);
  double Period() const { return StepPacer::Period(world_.sim_interval, world_.speedup); }
  void RunSteps();
  void Schedule(double now);
  void Unschedule();

  World& world_;
  Fl_Widget& canvas_;
  StepPacer pacer_;
  SpeedMeter speed_;
  FrameBudget budget_;
  RateMeter frames_;
  double interval_ = 0.04;
  bool stepping_enabled_ = false;  // stepping is enabled, see Begin()
  bool running_ = false;           // steps are scheduled
  bool idle_ = false;              // scheduled by the idle callback instead of a timer
  bool in_steps_ = false;          // prevents recursion: a step may run the event loop itself
  bool frame_scheduled_ = false;   // a frame is scheduled, by a timer or by redraw()
  uint64_t drawn_updates_ = 0;     // World::UpdateCount() at the last frame
};

}  // namespace Stg::internal::window

#endif
