// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/runner.hh"

#include <algorithm>

#include "threads/wall_clock.hh"
#include "world/world_handle.hh"

namespace Stg::internal::window {

using threads::WallClock;

namespace {
// Seconds of stepping between two rounds of the event loop: too short to notice, and long compared
// with the cost of the loop.
constexpr double kSlice = 0.01;
// Seconds between polls for changes without notification, such as a client that sets World::paused.
constexpr double kPollInterval = 0.2;
// Minimum seconds between frames that the user waits for, for example while dragging a robot.
constexpr double kMinInterval = 0.015;
}  // namespace

Runner::Runner(World& world, Fl_Widget& canvas) : world_(world), canvas_(canvas) {
  Fl::add_timeout(kPollInterval, OnPoll, this);
}

Runner::~Runner() {
  Unschedule();
  Fl::remove_timeout(OnFrame, this);
  Fl::remove_timeout(OnPoll, this);
}

// ---- steps --------------------------------------------------------------------------------------

void Runner::Unschedule() {
  Fl::remove_timeout(OnStep, this);
  if (idle_) Fl::remove_idle(OnStep, this);
  idle_ = false;
}

void Runner::Schedule(double now) {
  const double wait = pacer_.UntilNext(now, Period());
  const bool want_idle = wait <= 0;
  if (idle_ && want_idle) return;
  Unschedule();
  if (want_idle)
    Fl::add_idle(OnStep, this);
  else
    Fl::add_timeout(wait, OnStep, this);
  idle_ = want_idle;
}

void Runner::Reschedule() {
  const double now = WallClock();
  if (world_.paused || !stepping_enabled_) {
    Unschedule();
    running_ = false;
    return;
  }
  if (!running_) speed_.Restart(now, world_.SimTimeNow());
  running_ = true;
  pacer_.Restart(now, Period());
  if (!in_steps_) Schedule(now);
}

void Runner::Begin() {
  stepping_enabled_ = true;
  Reschedule();
}

void Runner::Halt() {
  stepping_enabled_ = false;
  Reschedule();
  speed_.Clear();
}

void Runner::RunSteps() {
  if (in_steps_) return;  // a controller runs the event loop within a step
  in_steps_ = true;
  World& world = world_;
  const WorldHandle handle(&world);
  double now = WallClock();
  const double end = now + kSlice;
  do {
    world.Update();
    if (!handle) return;  // the world and this runner were deleted
    now = WallClock();
  } while (stepping_enabled_ && !world_.paused && pacer_.UntilNext(now, Period()) <= 0 &&
           now < end);
  in_steps_ = false;
  if (!stepping_enabled_ || world_.paused)
    Reschedule();
  else
    Schedule(now);
}

void Runner::Stepped() {
  const double now = WallClock();
  pacer_.Stepped(now, Period());
  if (running_) speed_.Stepped(now, world_.SimTimeNow());
  RequestFrame();
}

// ---- frames -------------------------------------------------------------------------------------

void Runner::RequestFrame(bool soon) {
  if (frame_scheduled_ && !soon) return;
  const double now = WallClock();
  const bool late = running_ && pacer_.IsLate(now, Period());
  const double interval = soon || world_.paused ? kMinInterval : interval_;
  const double wait = budget_.Next(interval, late) - now;
  Fl::remove_timeout(OnFrame, this);
  frame_scheduled_ = true;
  if (wait > 0)
    Fl::add_timeout(wait, OnFrame, this);
  else
    canvas_.redraw();
}

void Runner::OnFrame(void* data) { static_cast<Runner*>(data)->canvas_.redraw(); }

void Runner::OnFrameDrawn(double start, double end) {
  // This frame shows the latest state, so a frame that is already scheduled is not needed.
  Fl::remove_timeout(OnFrame, this);
  frame_scheduled_ = false;
  budget_.OnFrameDrawn(start, end);
  frames_.Note(end);
  drawn_updates_ = world_.UpdateCount();
}

void Runner::OnPoll(void* data) {
  auto* runner = static_cast<Runner*>(data);
  const bool should_run = runner->stepping_enabled_ && !runner->world_.paused;
  if (runner->running_ != should_run) runner->Reschedule();
  if (runner->drawn_updates_ != runner->world_.UpdateCount()) runner->RequestFrame();
  Fl::repeat_timeout(kPollInterval, OnPoll, data);
}

}  // namespace Stg::internal::window
