// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drives as functions: the product of kinds, modes of control, bounds and time steps.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "motion/drive_table.hh"
#include "stage.hh"

namespace Stg {
namespace {

using motion::BuiltInDrive;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kAxes[] = {0, 1, 3};

double At(const Pose& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.a; }

/// Bounds of a robot, as in world files.
struct Limits {
  Bounds velocity[4], acceleration[4];

  Limits(double speed, double turn, double gain, double brake) {
    for (int axis = 0; axis < 4; axis++) {
      const double most = axis == 3 ? turn : speed;
      velocity[axis] = Bounds(-most, most);
      acceleration[axis] = Bounds(-brake, gain);
    }
  }
};

/// Calls f(kind, input) for the product of kinds, modes, bounds, steps, commands and velocities.
template <typename F>
void ForEachCase(F f) {
  const Limits limits[] = {
      {1, M_PI / 2, 1, 1}, {0.3, 0.2, 0.25, 0.5}, {kInfinity, kInfinity, 2, 0.1}};
  for (const BuiltInDrive kind : {motion::kDifferential, motion::kOmni, motion::kCar})
    for (const auto mode :
         {DriveInput::kAcceleration, DriveInput::kVelocity, DriveInput::kPosition})
      for (const Limits& bounds : limits)
        for (const double dt : {0.0, 0.001, 0.1, 1.0})
          for (const Pose& command : {Pose(), Pose(0.5, -0.2, 0, 0.4), Pose(-3, 2, 0, -1.2)})
            for (const Velocity& now :
                 {Velocity(), Velocity(0.25, 0, 0, -0.1), Velocity(-0.8, 0.3, 0, 1)}) {
              DriveInput in;
              in.mode = mode;
              in.command = command;
              in.velocity = now;
              in.estimate = Pose(0.2, 0.1, 0, 0.5);
              in.dt = dt;
              in.wheelbase = 0.6;
              in.steering_limit = in.steering_rate = kInfinity;
              in.velocity_bounds = bounds.velocity;
              in.acceleration_bounds = bounds.acceleration;
              f(kind, in);
            }
}

DriveOutput OutputOf(BuiltInDrive kind, const DriveInput& in) {
  return motion::DriveOf(kind).function(in);
}

// ---- the bounds ---------------------------------------------------------------------------------

TEST(DriveBounds, AccelerationBoundsHoldForEveryKindModeAndStep) {
  size_t limited = 0;
  ForEachCase([&](BuiltInDrive kind, DriveInput in) {
    const Velocity free = motion::Bounded(in, OutputOf(kind, in));
    in.limits_acceleration = true;
    const DriveOutput out = OutputOf(kind, in);
    const Velocity next = motion::Bounded(in, out);
    for (const int axis : kAxes) {
      if (axis == 3 && out.is_steered) continue;
      const double before = At(in.velocity, axis), after = At(next, axis);
      EXPECT_LE(after, before + in.acceleration_bounds[axis].max * in.dt + 1e-12);
      EXPECT_GE(after, before + in.acceleration_bounds[axis].min * in.dt - 1e-12);
      limited += after != At(free, axis);
    }
  });
  EXPECT_GT(limited, 500u) << "the bounds should matter in many cases";
}

TEST(DriveBounds, WithoutTheLimitEveryCommandActsAtOnceAsInStage43) {
  ForEachCase([](BuiltInDrive kind, const DriveInput& in) {
    if (in.mode != DriveInput::kVelocity) return;
    const DriveOutput out = OutputOf(kind, in);
    const double sine = SinCos(in.command.a).sine, cosine = SinCos(in.command.a).cosine;
    Velocity wanted(in.command.x, kind == motion::kOmni ? in.command.y : 0, 0, in.command.a);
    if (kind == motion::kCar)
      wanted = Velocity(in.command.x * cosine, 0, 0, in.command.x * sine / in.wheelbase);
    EXPECT_EQ(out.velocity, wanted);
    EXPECT_FALSE(out.is_steered);
    const Velocity next = motion::Bounded(in, out);
    for (const int axis : kAxes)
      EXPECT_EQ(At(next, axis), constrain(At(wanted, axis), in.velocity_bounds[axis].min,
                                          in.velocity_bounds[axis].max));
  });
}

TEST(DriveBounds, AVelocityOutsideOfItsBoundsReturnsToThemNoFasterThanAllowed) {
  const Limits limits(0.5, 1, 1, 1);
  DriveInput in;
  in.velocity_bounds = limits.velocity;
  in.acceleration_bounds = limits.acceleration;
  in.limits_acceleration = true;
  in.dt = 0.1;
  in.velocity = Velocity(2, 0, 0, 0);
  in.command = Pose(2, 0, 0, 0);
  EXPECT_DOUBLE_EQ(motion::Bounded(in, OutputOf(motion::kDifferential, in)).x, 1.9);
}

/// With a limited acceleration, position control brakes in time.
TEST(DriveBounds, AGoalIsReachedWithoutOvershootWhateverTheBrakes) {
  for (const double brake : {0.05, 0.2, 1.0})
    for (const double dt : {0.01, 0.1}) {
      const Limits limits(1, 1, 1, brake);
      DriveInput in;
      in.mode = DriveInput::kPosition;
      in.velocity_bounds = limits.velocity;
      in.acceleration_bounds = limits.acceleration;
      in.limits_acceleration = true;
      in.dt = dt;
      in.command = Pose(3, 0, 0, 0);
      double furthest = 0;
      for (double t = 0; t < 60; t += dt) {
        in.velocity = motion::Bounded(in, OutputOf(motion::kOmni, in));
        in.estimate.x += in.velocity.x * dt;
        furthest = std::max(furthest, in.estimate.x);
      }
      EXPECT_NEAR(in.estimate.x, 3, 0.01) << brake;
      EXPECT_LT(furthest, 3 + 0.02) << brake;
    }
}

// ---- cars ---------------------------------------------------------------------------------------

DriveInput CarInput(const Limits& limits) {
  DriveInput in;
  in.wheelbase = 0.5;
  in.dt = 0.1;
  in.steering_limit = in.steering_rate = kInfinity;
  in.velocity_bounds = limits.velocity;
  in.acceleration_bounds = limits.acceleration;
  return in;
}

TEST(Cars, ATurnCommandGivesTheAngleWhoseCircleHasThatTurnRate) {
  const Limits limits(5, 5, 1, 1);
  DriveInput in = CarInput(limits);
  in.commands_turn = true;
  for (const double speed : {0.1, 1.0, -1.0, 3.0})
    for (const double turn : {0.0, 0.3, -2.0}) {
      in.command = Pose(speed, 0, 0, turn);
      const DriveOutput out = OutputOf(motion::kCar, in);
      const Velocity v = motion::Bounded(in, out);
      EXPECT_NEAR(v.x, speed, 1e-12);
      EXPECT_NEAR(v.a, turn, 1e-12);
      EXPECT_NEAR(out.steering, std::atan(turn * in.wheelbase / speed), 1e-12);
    }
  in.command = Pose(0, 0, 0, 1);
  in.steering = 0.2;
  EXPECT_EQ(OutputOf(motion::kCar, in).steering, 0.2) << "a standing car keeps its angle";
  EXPECT_EQ(motion::Bounded(in, OutputOf(motion::kCar, in)).a, 0);
}

TEST(Cars, NoBoundOnTheSpeedMakesTheCircleSmallerThanTheSteeringLimitAllows) {
  const double limit = 0.4;
  for (const bool limits_acceleration : {false, true})
    for (const bool commands_turn : {false, true})
      for (const double speed : {0.2, 1.0, 9.0, -9.0}) {
        const Limits limits(1, 2, 0.5, 0.5);
        DriveInput in = CarInput(limits);
        in.limits_acceleration = limits_acceleration;
        in.commands_turn = commands_turn;
        in.steering_limit = limit;
        in.command = Pose(speed, 0, 0, 1.5);
        const DriveOutput out = OutputOf(motion::kCar, in);
        const Velocity v = motion::Bounded(in, out);
        EXPECT_LE(std::fabs(out.steering), limit);
        EXPECT_NE(v.x, 0);
        EXPECT_NEAR(v.a, v.x * std::tan(out.steering) / in.wheelbase, 1e-12);
      }
}

TEST(Cars, TheAngleChangesAtTheSteeringRateAtMost) {
  const Limits limits(5, 5, 1, 1);
  DriveInput in = CarInput(limits);
  in.steering_rate = 0.5;
  in.steering_limit = 0.3;
  in.command = Pose(1, 0, 0, 1);
  for (int step = 1; step <= 10; step++) {
    in.steering = OutputOf(motion::kCar, in).steering;
    EXPECT_NEAR(in.steering, std::min(0.05 * step, 0.3), 1e-12);
  }
  in.command.a = -1;
  in.steering = OutputOf(motion::kCar, in).steering;
  EXPECT_NEAR(in.steering, 0.25, 1e-12);
}

TEST(Cars, AnInfiniteSpeedIsClippedWithTheCircleOfTheSteering) {
  const Limits limits(1, 3, 1, 1);
  DriveInput in = CarInput(limits);
  in.steering_limit = 1;
  for (const double angle : {0.0, 0.5}) {
    in.command = Pose(kInfinity, 0, 0, angle);
    const Velocity v = motion::Bounded(in, OutputOf(motion::kCar, in));
    EXPECT_EQ(v.x, 1);
    EXPECT_NEAR(v.a, std::tan(angle) / in.wheelbase, 1e-12);
  }
}

// ---- the table ----------------------------------------------------------------------------------

DriveOutput StandStill(const DriveInput&) { return {}; }

TEST(DriveTable, FindsBuiltInAndRegisteredDrivesAndKeepsTheFirstOfAName) {
  EXPECT_EQ(motion::FindDrive("car"), &motion::DriveOf(motion::kCar));
  EXPECT_EQ(motion::FindDrive("anchor"), nullptr);
  EXPECT_TRUE(RegisterDrive("anchor", StandStill));
  ASSERT_NE(motion::FindDrive("anchor"), nullptr);
  EXPECT_EQ(motion::FindDrive("anchor")->function, &StandStill);
  EXPECT_NE(motion::DriveNames().find("\"anchor\""), std::string::npos);
  testing::internal::CaptureStderr();
  EXPECT_FALSE(RegisterDrive("anchor", StandStill));
  EXPECT_FALSE(RegisterDrive("omni", StandStill));
  const std::string errors = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 2) << errors;
  EXPECT_EQ(motion::FindDrive("omni"), &motion::DriveOf(motion::kOmni));
}

}  // namespace
}  // namespace Stg
