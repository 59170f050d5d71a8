// SPDX-License-Identifier: GPL-2.0-or-later
//
// Timing of steps and pictures, with a simulated clock and in FLTK's event loop.

#include <FL/Enumerations.H>
#include <FL/Fl.H>
#include <FL/Fl_Widget.H>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "gui/window/menu.hh"
#include "gui/window/pacing.hh"
#include "gui/window/runner.hh"
#include "stage.hh"
#include "threads/wall_clock.hh"

namespace Stg::internal::window {

namespace {

using threads::WallClock;

TEST(StepPacer, CatchesUpWithLateSteps) {
  StepPacer pacer;
  const double period = StepPacer::Period(100000, 2);
  EXPECT_DOUBLE_EQ(period, 0.05);
  pacer.Restart(10, period);
  EXPECT_NEAR(pacer.UntilNext(10, period), 0.05, 1e-12);
  // After a step of 0.12 s, two more are due at once, then the pacer waits again.
  double now = 10.05;
  pacer.Stepped(now += 0.12, period);
  EXPECT_LT(pacer.UntilNext(now, period), 0);
  pacer.Stepped(now, period);
  EXPECT_LT(pacer.UntilNext(now, period), 0);
  pacer.Stepped(now, period);
  EXPECT_NEAR(pacer.UntilNext(now, period), 0.03, 1e-9);
}

TEST(StepPacer, DoesNotRaceAfterALongStop) {
  StepPacer pacer;
  pacer.Restart(0, 0.1);
  pacer.Stepped(100, 0.1);
  int steps = 0;
  for (; pacer.UntilNext(100, 0.1) <= 0; steps++) pacer.Stepped(100, 0.1);
  EXPECT_EQ(steps, 6);
}

TEST(StepPacer, FastMeansAtOnce) {
  StepPacer pacer;
  EXPECT_EQ(StepPacer::Period(100000, -1), 0);
  pacer.Restart(5, 0);
  EXPECT_LE(pacer.UntilNext(5, 0), 0);
  EXPECT_TRUE(pacer.IsLate(5, 0));
}

/// With steps all the time and pictures of 0.3 s, drawing gets an eighth of the time.
TEST(FrameBudget, DrawingHasAnEighthOfTheTime) {
  FrameBudget budget;
  double now = 0, drawing = 0;
  while (now < 1000) {
    now = std::max(now + 0.001, budget.Next(0.04, true));  // steps continue meanwhile
    budget.OnFrameDrawn(now, now + 0.3);
    now += 0.3;
    drawing += 0.3;
  }
  EXPECT_NEAR(drawing / now, 1.0 / 8, 0.002);
}

TEST(FrameBudget, QuickPicturesComeAtTheInterval) {
  FrameBudget budget;
  budget.OnFrameDrawn(1, 1.002);
  EXPECT_DOUBLE_EQ(budget.Next(0.04, true), 1.04);
  budget.OnFrameDrawn(2, 2.1);
  EXPECT_DOUBLE_EQ(budget.Next(0.04, false), 2.1);
  EXPECT_DOUBLE_EQ(budget.Next(0.04, true), 2.8);
}

// ---- the runner ---------------------------------------------------------------------------------

void Spend(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

/// A world whose steps only take time.
class IdleWorld : public World {
 public:
  bool Update() override {
    Spend(0.005);
    runner->Stepped();
    return false;
  }
  Runner* runner = nullptr;
};

class Canvas : public Fl_Widget {
 public:
  Canvas() : Fl_Widget(0, 0, 100, 100) {}
  /// Spends 20 ms, like drawing a picture.
  double Paint(Runner* runner) {
    const double start = WallClock();
    Spend(0.02);
    clear_damage();
    runner->OnFrameDrawn(start, WallClock());
    return WallClock() - start;
  }

 private:
  void draw() override {}
};

/// An uncovered window is drawn out of turn, which must not start a second series of pictures.
TEST(Runner, ExtraPicturesCountTowardsTheBudget) {
  IdleWorld world;
  Canvas canvas;
  Runner runner(world, canvas);
  world.runner = &runner;
  world.speedup = -1;
  world.paused = false;
  canvas.clear_damage();
  runner.Begin();

  const double start = WallClock();
  double drawing = 0;
  bool out_of_turn = false;
  while (WallClock() - start < 3) {
    Fl::wait(0);
    if (canvas.damage() || (!out_of_turn && WallClock() - start > 0.3)) {
      out_of_turn |= !canvas.damage();
      drawing += canvas.Paint(&runner);
    }
  }
  EXPECT_TRUE(out_of_turn);
  EXPECT_GT(drawing, 0.1);
  EXPECT_LT(drawing / (WallClock() - start), 0.16);
}

// ---- meters -------------------------------------------------------------------------------------

TEST(SpeedMeter, LeavesOutPauses) {
  SpeedMeter meter;
  EXPECT_EQ(meter.ratio(), 0);
  meter.Restart(0, 0);
  for (int i = 1; i <= 30; i++) meter.Stepped(0.05 * i, static_cast<usec_t>(i) * 100000);
  EXPECT_NEAR(meter.ratio(), 2, 1e-9);
  meter.Restart(100, 3000000);
  EXPECT_NEAR(meter.ratio(), 2, 1e-9) << "the old ratio remains until there is a new one";
  for (int i = 1; i <= 3; i++)
    meter.Stepped(100 + 0.1 * i, 3000000 + static_cast<usec_t>(i) * 100000);
  EXPECT_NEAR(meter.ratio(), 1, 1e-9);
}

TEST(RateMeter, CountsOverASecond) {
  RateMeter meter;
  for (int i = 0; i < 100; i++) meter.Note(0.04 * i);
  EXPECT_NEAR(meter.rate(), 25, 1e-6);
}

TEST(Shortcuts, HaveFltksNumbers) {
  EXPECT_EQ(ShortcutNumber(""), 0);
  EXPECT_EQ(ShortcutNumber("d"), 'd');
  EXPECT_EQ(ShortcutNumber("{"), '{');
  EXPECT_EQ(ShortcutNumber("space"), ' ');
  EXPECT_EQ(ShortcutNumber("Ctrl+O"), FL_CTRL | 'o');
  EXPECT_EQ(ShortcutNumber("Ctrl+Shift+s"), FL_CTRL | FL_SHIFT | 's');
}

}  // namespace

}  // namespace Stg::internal::window
