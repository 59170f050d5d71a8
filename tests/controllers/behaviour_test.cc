// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controllers stage/orca and stage/behaviour.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "kernels/row_behaviour.h"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"
#include "world/engine.hh"
#include "worlds/pool_access.hh"

namespace Stg {
namespace {

using test::RandomSource;

std::unique_ptr<World> LoadBehaviours(const std::string& text, uint64_t seed = 1) {
  InitLibrary();
  auto world = std::make_unique<World>(OptionsOf(seed));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

std::vector<ModelPosition*> Robots(const World& world) {
  std::vector<ModelPosition*> robots;
  for (Model* model : world.GetChildren())
    if (auto* const robot = dynamic_cast<ModelPosition*>(model)) robots.push_back(robot);
  return robots;
}

std::string Text(double number) {
  std::ostringstream text;
  text.precision(17);
  text << number;
  return text.str();
}

/// A robot of 0.4 m, without limits of its velocity.
std::string Robot(const std::string& drive, double x, double y, double degrees,
                  const std::string& ctrl) {
  return "position( size [0.4 0.4 0.4] drive \"" + drive +
         "\" velocity_bounds [-9 9 -9 9 0 0 -999 999] pose [" + Text(x) + " " + Text(y) + " 0 " +
         Text(degrees) + "] ctrl \"" + ctrl + "\" )\n";
}

std::string Goal(double x, double y) { return " x=" + Text(x) + " y=" + Text(y); }

// ---- reciprocal avoidance ----

/// Distance at which discs around two robots touch.
const double kTouch = 0.4 * std::sqrt(2.0);

/// Two robots that want to swap their places, turned by an angle about the origin.
std::string HeadOn(const std::string& ctrl, double degrees) {
  const double x = 3 * std::cos(degrees * M_PI / 180), y = 3 * std::sin(degrees * M_PI / 180);
  return "contacts \"cells\"\n" + Robot("omni", -x, -y, degrees, ctrl + Goal(x, y)) +
         Robot("omni", x, y, degrees + 180, ctrl + Goal(-x, -y));
}

class Avoiding : public testing::TestWithParam<const char*> {};

TEST_P(Avoiding, TwoThatMeetHeadOnPassEachOtherSymmetricallyWithoutContact) {
  const auto world = LoadBehaviours(HeadOn(GetParam(), 0));
  const std::vector<ModelPosition*> robots = Robots(*world);
  double nearest = 10, aside = 0;
  for (int step = 0; step < 110; step++) {
    ASSERT_FALSE(world->Update());
    const Pose a = robots[0]->GetPose(), b = robots[1]->GetPose();
    nearest = std::min(nearest, a.Distance(b));
    aside = std::min(aside, a.y);
    ASSERT_FALSE(robots[0]->Stalled() || robots[1]->Stalled()) << step;
    EXPECT_NEAR(a.x, -b.x, 1e-9) << step;
    EXPECT_NEAR(a.y, -b.y, 1e-9) << step;
  }
  EXPECT_GT(nearest, kTouch + 0.04);
  EXPECT_LT(nearest, 0.7) << "no more room than they need";
  EXPECT_LT(aside, -0.2) << "to the right";
  EXPECT_LT(robots[0]->GetPose().Distance(Pose(3, 0, 0, 0)), 0.1);
  EXPECT_LT(robots[1]->GetPose().Distance(Pose(-3, 0, 0, 0)), 0.1);
}

TEST_P(Avoiding, ATurnedWorldHasTheTurnedCourseToRounding) {
  constexpr double kAngle = 37 * M_PI / 180;
  const auto world = LoadBehaviours(HeadOn(GetParam(), 0));
  const auto turned = LoadBehaviours(HeadOn(GetParam(), 37));
  for (int step = 0; step < 110; step++) {
    ASSERT_FALSE(world->Update());
    ASSERT_FALSE(turned->Update());
    const Pose a = Robots(*world)[0]->GetPose(), b = Robots(*turned)[0]->GetPose();
    EXPECT_NEAR(b.x, a.x * std::cos(kAngle) - a.y * std::sin(kAngle), 1e-6) << step;
    EXPECT_NEAR(b.y, a.x * std::sin(kAngle) + a.y * std::cos(kAngle), 1e-6) << step;
  }
}

/// Robots on a circle that want to go to the opposite side.
std::string Circle(int count, double radius, const std::string& drive, const std::string& ctrl) {
  std::string text = "contacts \"cells\"\n";
  for (int i = 0; i < count; i++) {
    const double angle = 2 * M_PI * i / count;
    const double x = radius * std::cos(angle), y = radius * std::sin(angle);
    text += Robot(drive, x, y, angle * 180 / M_PI + 180, ctrl + Goal(-x, -y));
  }
  return text;
}

TEST_P(Avoiding, EightOnACircleSwapTheirPlacesWithoutContact) {
  const auto world = LoadBehaviours(Circle(8, 4, "omni", GetParam()));
  const std::vector<ModelPosition*> robots = Robots(*world);
  double nearest = 10;
  for (int step = 0; step < 250; step++) {
    ASSERT_FALSE(world->Update());
    for (size_t i = 0; i < robots.size(); i++) {
      ASSERT_FALSE(robots[i]->Stalled()) << i << " in step " << step << " nearest " << nearest;
      for (size_t k = 0; k < i; k++)
        nearest = std::min(nearest, robots[i]->GetPose().Distance(robots[k]->GetPose()));
    }
  }
  EXPECT_GT(nearest, kTouch + 0.02);
  for (size_t i = 0; i < robots.size(); i++) {
    const double angle = 2 * M_PI * static_cast<double>(i) / 8 + M_PI;
    EXPECT_LT(robots[i]->GetPose().Distance(Pose(4 * std::cos(angle), 4 * std::sin(angle), 0, 0)),
              0.1)
        << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Controllers, Avoiding,
                         testing::Values("stage/orca", "stage/behaviour kind=4"));

TEST(Orca, OneAloneIsAtItsGoalAfterDistanceBySpeed) {
  // The first update finds the command, which moves the robot from the second one on.
  const auto world =
      LoadBehaviours(Robot("omni", 1, 2, 0, "stage/orca x=4 y=6 speed=1 tolerance=0.001"));
  const ModelPosition& robot = *Robots(*world)[0];
  for (int step = 1; step <= 60; step++) {
    world->Update();
    const double way = 0.1 * std::min(step - 1, 50);
    EXPECT_NEAR(robot.GetPose().x, 1 + 0.6 * way, 1e-9) << step;
    EXPECT_NEAR(robot.GetPose().y, 2 + 0.8 * way, 1e-9) << step;
  }
}

TEST(Orca, ARobotWithLimitedAccelerationNeedsTheTimeToAccelerateMore) {
  // It needs 2 s and 1 m to become 1 m/s fast, instead of 1 s, and overshoots little.
  const auto world = LoadBehaviours(
      "position( drive \"omni\" limit_acceleration 1 acceleration_bounds [-5 0.5 -5 0.5 0 0 -99 "
      "99] "
      "ctrl \"stage/orca x=6 y=0 speed=1 tolerance=0.2\" )\n");
  const ModelPosition& robot = *Robots(*world)[0];
  int steps = 0;
  while (robot.GetPose().x < 5.8 && steps < 200) {
    world->Update();
    steps++;
  }
  EXPECT_NEAR(0.1 * steps, 5.8 + 1 + 0.1, 0.2);
}

TEST(Orca, OneWithRangersDrivesThroughADoorWithoutTouchingItsPosts) {
  const auto world = LoadBehaviours(
      "contacts \"cells\"\nmodel( size [0.2 3 1] pose [0 2.1 0 0] )\n"
      "model( size [0.2 3 1] pose [0 -2.1 0 0] )\n"
      "position( size [0.3 0.3 0.3] pose [-3 0.9 0 0] drive \"omni\" "
      "ctrl \"stage/orca x=3 y=0.2 speed=1\"\n"
      "  ranger( pose [0 0 -0.1 0] sensor( range [0 4] fov 360 samples 73 ) ) )\n");
  const ModelPosition& robot = *Robots(*world)[0];
  for (int i = 0; i < 150; i++) {
    world->Update();
    ASSERT_FALSE(robot.Stalled()) << i << " at " << robot.GetPose().x << " " << robot.GetPose().y;
  }
  EXPECT_LT(robot.GetPose().Distance(Pose(3, 0.2, 0, 0)), 0.1);
}

// ---- linear programs ----

double WorstOf(const row_planes_t& planes, row_point_t v) {
  double worst = 0;
  for (uint32_t i = 0; i < planes.count; i++)
    worst = std::max(worst, planes.plane[i].least - row_dot(planes.plane[i].normal, v));
  return worst;
}

/// Compares the programs with a search on a fine raster of velocities.
TEST(LinearPrograms, FindWhatASearchFinds) {
  RandomSource random(7);
  int infeasible = 0;
  for (int round = 0; round < 300; round++) {
    row_planes_t planes{};
    planes.count = static_cast<uint32_t>(random.Int(1, 8));
    for (uint32_t i = 0; i < planes.count; i++) {
      const double angle = random.Real(-M_PI, M_PI);
      planes.plane[i] = {{std::cos(angle), std::sin(angle)}, random.Real(-0.8, 0.6), 0};
    }
    const row_point_t wanted = {random.Real(-1, 1), random.Real(-1, 1)};
    row_point_t v;
    const uint32_t failed = row_allowed(planes.plane, planes.count, 1, wanted, 0, &v);
    if (failed < planes.count) row_violate_least(&planes, failed, 1, &v);
    infeasible += failed < planes.count;
    const double worst = WorstOf(planes, v);
    const auto distance = [&](row_point_t p) { return row_length(row_minus(p, wanted)); };
    ASSERT_LE(row_length(v), 1 + 1e-9);
    EXPECT_EQ(failed == planes.count, worst < 1e-9) << round;
    for (double x = -1; x <= 1; x += 0.02)
      for (double y = -1; y <= 1; y += 0.02) {
        const row_point_t other = {x, y};
        if (x * x + y * y > 1) continue;
        const double violation = WorstOf(planes, other);
        const bool is_allowed = failed == planes.count && violation <= 0;
        ASSERT_GE(violation, is_allowed ? 0 : worst - 1e-9) << round;
        ASSERT_GE(is_allowed ? distance(other) : 10, distance(v) - 1e-9) << round;
      }
  }
  EXPECT_GT(infeasible, 50);
  EXPECT_LT(infeasible, 250);
}

/// A change of the relative velocity out of the velocity obstacle leaves no collision before the
/// horizon; half of the change does not suffice.
TEST(VelocityObstacles, EndWhereDiscsTouchAtTheHorizon) {
  RandomSource random(3);
  const auto nearest = [](const row_encounter_t& met, row_point_t v) {
    double least = 100;
    for (int i = 0; i <= 4000; i++)
      least = std::min(least, row_length(row_minus(met.way, row_times(met.time * i / 4000.0, v))));
    return least;
  };
  int inside = 0;
  for (int round = 0; round < 300; round++) {
    const row_encounter_t met = {{random.Real(-3, 3), random.Real(-3, 3)},
                                 {random.Real(-2, 2), random.Real(-2, 2)},
                                 0.6,
                                 2,
                                 0.5};
    if (row_length(met.way) < 0.7) continue;
    double excess = 0;
    const row_point_t normal = row_way_out(&met, 0.1, &excess);
    EXPECT_NEAR(row_length(normal), 1, 1e-12);
    EXPECT_EQ(excess > 0, nearest(met, met.velocity) < 0.6 - 1e-6) << round;
    const row_point_t out = row_plus(met.velocity, row_times(excess, normal));
    EXPECT_NEAR(nearest(met, out), 0.6, 1e-3) << round;
    inside += excess > 0;
  }
  EXPECT_GT(inside, 20);
}

// ---- the velocity that is chosen ----

/// The velocity that one of several robots chooses. They have a radius of 0.2 m.
row_point_t Chosen(const std::vector<row_planar_t>& poses,
                   const std::vector<row_planar_t>& velocities, uint32_t own, double interval,
                   row_point_t wanted) {
  const row_evader_t rule = {.time = 2, .wall_time = 1, .range = 5, .most = 10};
  const row_mobility_t body = {.speed = 2, .radius = 0.2, .interval = interval};
  const row_company_t all = {poses.data(), velocities.data(), static_cast<uint32_t>(poses.size()),
                             own};
  const row_layout_t blind{};
  return row_evade(&rule, &body, &blind, nullptr, &all, wanted);
}

TEST(ReciprocalAvoidance, BothHalvesTogetherJustAvoidTheCollision) {
  const std::vector<row_planar_t> poses = {{0, 0, 0}, {2, 0.1, 0}};
  const std::vector<row_planar_t> velocities = {{1.5, 0, 0}, {-1.5, 0, 0}};
  const row_point_t a = Chosen(poses, velocities, 0, 1e-9, {1.5, 0});
  const row_point_t b = Chosen(poses, velocities, 1, 1e-9, {-1.5, 0});
  const row_point_t way = {2, 0.1}, relative = row_minus(a, b);
  const double nearest = std::abs(row_cross(way, relative)) / row_length(relative);
  EXPECT_NEAR(nearest, 0.4 + ROW_CLEARANCE, 1e-6);
  EXPECT_NEAR(a.y, -b.y, 1e-6) << "both make the same effort";
}

TEST(ReciprocalAvoidance, OneThatIsSqueezedSharesTheRoomThatLacks) {
  // It lacks 0.15 m ahead and 0.1 m behind, of which it makes up for half in 0.1 s: at best, both
  // velocities of 0.75 and 0.5 m/s are missed by 0.625 m/s.
  const std::vector<row_planar_t> poses = {{0, 0, 0}, {0.3, 0, 0}, {-0.35, 0, 0}};
  const std::vector<row_planar_t> velocities(3, {0, 0, 0});
  EXPECT_NEAR(Chosen(poses, velocities, 0, 0.1, {0, 0}).x, -0.125, 1e-9);
}

// ---- behaviours ----

TEST(Behaviours, OneThatStandsStands) {
  for (const char* kind : {"", " kind=0 vx=1 vy=1 rate=1 x=3 y=3"}) {
    const auto world =
        LoadBehaviours(Robot("omni", 1, 2, 30, std::string("stage/behaviour") + kind) +
                       Robot("omni", 1.5, 2, 0, "stage/behaviour"));
    const ModelPosition& robot = *Robots(*world)[0];
    const Pose start = robot.GetPose();
    for (int i = 0; i < 30; i++) world->Update();
    EXPECT_EQ(robot.GetPose(), start);
    EXPECT_TRUE(robot.GetVelocity().IsZero());
  }
}

TEST(Behaviours, OneThatGoesOnKeepsItsGlobalVelocityWhileItTurns) {
  for (const char* turn : {"", " turn=0"}) {
    const auto world = LoadBehaviours(
        Robot("omni", 0, 0, -70, std::string("stage/behaviour kind=1 vx=0.3 vy=0.4") + turn));
    const ModelPosition& robot = *Robots(*world)[0];
    for (int step = 1; step <= 50; step++) {
      world->Update();
      EXPECT_NEAR(robot.GetPose().x, 0.03 * (step - 1), 1e-9) << step;
      EXPECT_NEAR(robot.GetPose().y, 0.04 * (step - 1), 1e-9) << step;
    }
    const double heading = *turn ? -70 * M_PI / 180 : std::atan2(4, 3);
    EXPECT_NEAR(robot.GetPose().a, heading, 1e-3);
  }
}

TEST(Behaviours, OneThatGoesOnWithARateDrivesOnACircle) {
  for (const char* drive : {"diff", "omni"}) {
    // The radius is 0.5 / 0.5 = 1 m; chords of 0.05 m.
    const auto world =
        LoadBehaviours(Robot(drive, 0, -1, 0, "stage/behaviour kind=1 vx=0.5 rate=0.5"));
    const ModelPosition& robot = *Robots(*world)[0];
    double most = 0;
    for (int step = 0; step < 200; step++) {
      world->Update();
      EXPECT_NEAR(robot.GetPose().Distance(Pose(0, 0, 0, 0)), 1, 0.06) << drive << step;
      most = std::max(most, robot.GetPose().y);
    }
    EXPECT_GT(most, 0.9);
  }
}

TEST(Behaviours, OneThatGoesStraightStopsExactlyAtItsGoal) {
  const auto world = LoadBehaviours(
      Robot("omni", -1, 0, 50, "stage/behaviour kind=2 x=1 y=1.5 speed=0.8 tolerance=0.001"));
  const ModelPosition& robot = *Robots(*world)[0];
  for (int step = 1; step <= 60; step++) {
    world->Update();
    const double way = std::min(0.08 * (step - 1), 2.5);
    EXPECT_NEAR(robot.GetPose().x, -1 + 0.8 * way, 1e-9) << step;
    EXPECT_NEAR(robot.GetPose().y, 0.6 * way, 1e-9) << step;
  }
}

TEST(Behaviours, RobotsWithWheelsReachTheirGoalsFromAnyHeading) {
  for (const char* kind : {"2", "3", "4"})
    for (double heading = -180; heading < 180; heading += 60) {
      const auto world = LoadBehaviours(
          Robot("diff", 0, 0, heading, std::string("stage/behaviour x=1.5 y=-1 kind=") + kind));
      for (int i = 0; i < 120; i++) world->Update();
      EXPECT_LT(Robots(*world)[0]->GetPose().Distance(Pose(1.5, -1, 0, 0)), 0.25)
          << kind << " " << heading;
    }
}

TEST(Behaviours, OneThatWalksWalksLikeAPedestrian) {
  const auto course = [](const std::string& ctrl) {
    const auto world =
        LoadBehaviours("contacts \"cells\"\n" + Robot("omni", -3, 0.05, 10, ctrl + Goal(3, 0.05)) +
                       Robot("omni", 3, -0.05, 170, ctrl + Goal(-3, -0.05)));
    std::vector<Pose> poses;
    for (int i = 0; i < 130; i++) {
      world->Update();
      poses.push_back(Robots(*world)[0]->GetPose());
    }
    return poses;
  };
  const std::vector<Pose> a = course("stage/pedestrian");
  const std::vector<Pose> b = course("stage/behaviour kind=3 tolerance=0.2");
  double aside = 0;
  for (size_t i = 0; i < a.size(); i++) {
    EXPECT_LT(a[i].Distance(b[i]), 1e-9) << i;
    aside = std::max(aside, std::abs(a[i].y));
  }
  EXPECT_GT(aside, 0.2);
}

TEST(Behaviours, NumbersThatAreNoKindStand) {
  std::array<double, ROW_BEHAVIOUR_SIZE> memory{};
  for (const double kind : {-1.0, 0.5, 4.5, 5.0, 1e300, -1e300, double(NAN), double(INFINITY)}) {
    memory[ROW_BEHAVIOUR_KIND] = kind;
    EXPECT_EQ(row_behaviour_of(memory.data()), ROW_STANDS) << kind;
  }
  for (int kind = 0; kind < ROW_BEHAVIOURS; kind++) {
    memory[ROW_BEHAVIOUR_KIND] = kind;
    EXPECT_EQ(row_behaviour_of(memory.data()), kind);
  }
}

// ---- memory in World objects and in rows ----

using Memory = std::array<double, ROW_BEHAVIOUR_SIZE>;

Memory RandomMemory(RandomSource* random) {
  Memory memory{};
  memory[ROW_BEHAVIOUR_KIND] = random->Int(0, ROW_BEHAVIOURS - 1);
  for (int k = ROW_BEHAVIOUR_X; k < ROW_BEHAVIOUR_SIZE; k++) memory[k] = random->Real(-1.5, 1.5);
  memory[ROW_BEHAVIOUR_SPEED] = random->Real(0, 1);
  return memory;
}

/// Robots with wheels and without, some with rangers.
std::string Mixed() {
  std::string text = "contacts \"cells\"\nmodel( size [0.4 0.4 1] )\n";
  for (int i = 0; i < 8; i++) {
    const double angle = 2 * M_PI * i / 8;
    text += "position( size [0.3 0.3 0.3] drive \"" + std::string(i % 2 ? "diff" : "omni") +
            "\" pose [" + Text(2 * std::cos(angle)) + " " + Text(2 * std::sin(angle)) + " 0 " +
            Text(80.0 * i) + "] ctrl \"stage/behaviour kind=" + std::to_string(i % 5) +
            Goal(-0.5, 0.2 * i) + " vx=0.2 rate=" + Text(i % 3 * 0.2) + "\"";
    if (i % 3 == 0) text += " ranger( pose [0 0 -0.1 0] sensor( range [0 3] fov 270 samples 28 ) )";
    text += " )\n";
  }
  return text;
}

double* MemoryOf(const World& world, size_t robot) {
  const auto& groups = world.engine().batch_controls.Groups(world.engine());
  return groups[0].robots[robot]->memory.data();
}

double* MemoryOf(WorldPool* pool, uint32_t world, size_t robot) {
  const PoolRow at = PoolAccess::RowToChange(*pool, world);
  const rows::Controls& controls = at.rows->scene().controls;
  return &at.rows->columns.memory[at.row * controls.memory_count + controls.groups[0].first_memory +
                                  robot * ROW_BEHAVIOUR_SIZE];
}

TEST(BehaviourMemory, ArgumentsAreItsFirstContent) {
  const auto world = LoadBehaviours(
      Robot("omni", 0, 0, 0, "stage/behaviour kind=2 x=1 y=2 speed=0.9 vx=3 vy=4 rate=-0.5"));
  const Memory expected = {2, 1, 2, 0.9, 3, 4, -0.5, 0, 0};
  EXPECT_TRUE(std::ranges::equal(expected, std::span(MemoryOf(*world, 0), ROW_BEHAVIOUR_SIZE)));
  WorldPool pool(*world, {1, 2});
  for (const uint32_t id : pool.All())
    EXPECT_TRUE(
        std::ranges::equal(expected, std::span(MemoryOf(&pool, id, 0), ROW_BEHAVIOUR_SIZE)));
}

TEST(BehaviourMemory, RowsEqualWorldsWhenItIsWrittenBetweenStepsAndSnapshotsHaveIt) {
  RandomSource random(5);
  const std::vector<uint64_t> seeds = {1, 2, 3};
  const auto prototype = LoadBehaviours(Mixed(), 9);
  WorldPool pool(*prototype, seeds);
  std::vector<std::unique_ptr<World>> alone;
  for (const uint64_t seed : seeds) alone.push_back(LoadBehaviours(Mixed(), seed));
  double way = 0;
  for (int round = 0; round < 60; round++) {
    for (const uint32_t id : pool.All())
      for (size_t robot = 0; robot < 8; robot++) {
        if (!random.OneIn(4)) continue;
        const Memory memory = RandomMemory(&random);
        std::ranges::copy(memory, MemoryOf(&pool, id, robot));
        std::ranges::copy(memory, MemoryOf(*alone[id], robot));
      }
    const Pose before = Robots(*alone[0])[0]->GetPose();
    pool.Step(pool.All(), 5);
    for (const auto& world : alone)
      for (int i = 0; i < 5; i++) ASSERT_FALSE(world->Update());
    way += Robots(*alone[0])[0]->GetPose().Distance(before);
    if (round % 10 == 5) {
      Snapshot of_pool, of_alone;
      ASSERT_TRUE(pool.Take(0, &of_pool));
      ASSERT_TRUE(alone[0]->Take(&of_alone));
      pool.Restore({2}, of_pool);
      ASSERT_TRUE(alone[2]->Restore(of_alone));
      EXPECT_TRUE(std::ranges::equal(std::span(MemoryOf(*alone[0], 3), ROW_BEHAVIOUR_SIZE),
                                     std::span(MemoryOf(&pool, 2, 3), ROW_BEHAVIOUR_SIZE)));
      EXPECT_TRUE(std::ranges::equal(std::span(MemoryOf(*alone[0], 3), ROW_BEHAVIOUR_SIZE),
                                     std::span(MemoryOf(*alone[2], 3), ROW_BEHAVIOUR_SIZE)));
    }
    for (const uint32_t id : pool.All())
      ASSERT_EQ(pool.StateHashes({id})[0], alone[id]->StateHash()) << round << " world " << id;
  }
  EXPECT_GT(way, 1);
}

// ---- mistakes ----

TEST(BehaviourArguments, MistakesAreReportedInOneLine) {
  const auto error = [](const std::string& ctrl) {
    const LoadOutcome outcome = TryToLoad("position( name \"r\" ctrl \"" + ctrl + "\" )\n");
    EXPECT_FALSE(outcome.loaded);
    return outcome.errors.substr(outcome.errors.find("\"r\": ") + 5);
  };
  const std::string kinds = "expected a number from 0 to 4\n";
  EXPECT_EQ(error("stage/behaviour kind=5"), "found \"kind=5\", " + kinds);
  EXPECT_EQ(error("stage/behaviour kind=-1"), "found \"kind=-1\", " + kinds);
  EXPECT_EQ(error("stage/behaviour kind=nan"), "found \"kind=nan\", " + kinds);
  EXPECT_EQ(error("stage/behaviour kind=1.5"), "found \"kind=1.5\", expected a whole number\n");
  EXPECT_EQ(error("stage/behaviour kind=2 x=1"), "found no argument y, expected y=NUMBER\n");
  EXPECT_EQ(error("stage/orca x=1"), "found no argument y, expected y=NUMBER\n");
  EXPECT_EQ(error("stage/orca x=1 y=2 neighbours=17"),
            "found \"neighbours=17\", expected a number from 1 to 16\n");
  EXPECT_EQ(error("stage/orca x=1 y=2 neighbours=2.5"),
            "found \"neighbours=2.5\", expected a whole number\n");
}

}  // namespace
}  // namespace Stg
