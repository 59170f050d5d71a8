// SPDX-License-Identifier: GPL-2.0-or-later
//
// Batch controllers in World objects and in rows.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "kernels/row_pedestrian.h"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "world/engine.hh"
#include "worlds/pool_access.hh"

namespace Stg {
namespace {

std::unique_ptr<World> LoadSeeded(const std::string& text, uint64_t seed, int threads = 1) {
  InitLibrary();
  RunOptions options = OptionsOf(seed);
  options.threads = threads;
  options.share_from = 1;
  auto world = std::make_unique<World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

std::string PluginOf(const std::string& path) {
  const char* const build = std::getenv("STAGE_BINARY_DIR");
  return std::string(build ? build : ".") + "/" + path + ".so";
}
std::string Herd() { return PluginOf("tests/plugins/herd"); }

/// Robots with lasers in a room with things, all with the controllers `ctrl`.
std::string Room(const std::string& ctrl, const std::string& more = "") {
  std::string text = "contacts \"cells\"\ndefine robot position( size [0.3 0.3 0.3] ctrl [\"" +
                     ctrl + "\"] " + more +
                     "\n  ranger( pose [0 0 -0.1 0] sensor( range [0 3] fov 240 samples 24 ) ) )\n";
  for (const char* wall : {"0 2 0 0", "0 -2 0 0", "2 0 0 90", "-2 0 0 90"})
    text += std::string("model( size [4 0.1 1] pose [") + wall + "] )\n";
  text += "model( size [0.5 0.3 1] pose [0.2 0.1 0 30] )\n";
  for (const char* pose : {"-1 -1 0 10", "1 -1 0 100", "1 1 0 200", "-1 1 0 -60"})
    text += std::string("robot( pose [") + pose + "] )\n";
  return text;
}

std::vector<ModelPosition*> RobotsOf(const World& world) {
  std::vector<ModelPosition*> robots;
  for (Model* model : world.GetChildren())
    if (auto* const robot = dynamic_cast<ModelPosition*>(model)) robots.push_back(robot);
  return robots;
}

constexpr const char* kNoisy = "localization \"odom\" odom_noise [0.02 0.01 0.03 0.02]";

// ---- built-in controllers equal the plug-ins with callbacks ----

/// Compares the states of robots with a built-in controller and with a plug-in of the same rules.
void ExpectSameRobots(const std::string& built_in, const std::string& plugin, int steps) {
  const auto a = LoadSeeded(built_in, 5), b = LoadSeeded(plugin, 5);
  size_t stalls = 0, turns = 0;
  for (int step = 0; step < steps; step++) {
    ASSERT_FALSE(a->Update());
    ASSERT_FALSE(b->Update());
    const std::vector<ModelPosition*> of_a = RobotsOf(*a), of_b = RobotsOf(*b);
    ASSERT_EQ(of_a.size(), of_b.size());
    for (size_t i = 0; i < of_a.size(); i++) {
      ASSERT_EQ(of_a[i]->GetPose(), of_b[i]->GetPose()) << "robot " << i << " in step " << step;
      ASSERT_EQ(of_a[i]->est_pose, of_b[i]->est_pose) << "robot " << i << " in step " << step;
      ASSERT_EQ(of_a[i]->GetVelocity(), of_b[i]->GetVelocity());
      stalls += of_a[i]->Stalled();
      turns += of_a[i]->GetVelocity().a != 0;
    }
  }
  EXPECT_GT(turns, 100u);
  (void)stalls;
}

TEST(BuiltInControllers, WanderDrivesAsThePluginWithCallbacks) {
  ExpectSameRobots(Room("stage/wander"), Room("wander"), 1000);
  ExpectSameRobots(Room("stage/wander", kNoisy), Room("wander", kNoisy), 1000);
}

TEST(BuiltInControllers, DisperseDrivesAsThePluginWithCallbacks) {
  const std::string sonars =
      "ranger( pose [0.1 0 -0.1 20] sensor( pose [0 0.1 0 90] range [0 2] fov 5 samples 1 ) "
      "sensor( pose [0.05 0 0 -120] range [0 6] fov 400 samples 33 ) sensor( samples 0 ) )";
  const std::string few = " speed=0.7 gain=2 turn=1 margin=0.05 horizon=2.5";
  for (const std::string& more : {std::string(kNoisy), sonars, "origin [0.05 0.1 0 20] " + sonars})
    for (const std::string& arguments : {std::string(), few})
      ExpectSameRobots(Room("stage/disperse" + arguments, more), Room("disperse" + arguments, more),
                       500);
}

// ---- rules ----

TEST(BuiltInControllers, GoalArrivesWhenTheFormulaSays) {
  // It commands 0.5 m/s in each step of 0.1 s, first in the step after the first update, until the
  // estimate is within 0.12 m of the goal, 3 m away.
  const auto world = LoadSeeded(
      "position( pose [1 2 0 90] ctrl \"stage/goal x=1 y=5 speed=0.5 tolerance=0.12\" )\n", 1);
  const ModelPosition& robot = *RobotsOf(*world)[0];
  for (int i = 0; i < 100; i++) {
    const int moves = std::min(std::max(i - 1, 0), 59);
    EXPECT_NEAR(robot.GetPose().y, 2 + 0.05 * moves, 1e-9) << i;
    world->Update();
  }
  EXPECT_NEAR(robot.GetPose().y, 4.95, 1e-9);
  EXPECT_NEAR(robot.GetPose().x, 1, 1e-9);
}

TEST(BuiltInControllers, GoalReachesItsPlaceAndHeadingFromAnywhere) {
  std::string text;
  for (int i = 0; i < 12; i++)
    text += "position( size [0.1 0.1 0.1] obstacle_return 0 drive \"" +
            std::string(i % 2 ? "omni" : "diff") + "\" pose [" + std::to_string(i - 6) + " " +
            std::to_string(i % 5 - 2) + " 0 " + std::to_string(i * 77) +
            "] ctrl \"stage/goal x=0.5 y=-0.3 heading=135\" )\n";
  const auto world = LoadSeeded(text, 1);
  for (int i = 0; i < 600; i++) world->Update();
  for (const ModelPosition* robot : RobotsOf(*world)) {
    EXPECT_LT(robot->GetPose().Distance(Pose(0.5, -0.3, 0, 0)), 0.1);
    EXPECT_NEAR(robot->GetPose().a, 135 * M_PI / 180, 0.02);
    EXPECT_TRUE(robot->GetVelocity().IsZero());
  }
}

/// Two pedestrians that meet; `sign` -1: in a mirror.
std::string Meeting(int sign) {
  const auto number = [&](double value) { return std::to_string(sign * value); };
  return "contacts \"cells\"\ndefine walker position( size [0.4 0.4 0.4] drive \"omni\" )\n"
         "walker( pose [-3 " +
         number(0.05) + " 0 " + number(10) + "] ctrl \"stage/pedestrian x=3 y=" + number(0.05) +
         "\" )\n"
         "walker( pose [3 " +
         number(-0.05) + " 0 " + number(170) + "] ctrl \"stage/pedestrian x=-3 y=" + number(-0.05) +
         "\" )\n";
}

TEST(BuiltInControllers, PedestriansEvadeEachOtherAndMirrorImagesDoSoInAMirror) {
  const auto world = LoadSeeded(Meeting(1), 1), mirror = LoadSeeded(Meeting(-1), 1);
  const std::vector<ModelPosition*> robots = RobotsOf(*world), mirrored = RobotsOf(*mirror);
  double nearest = 10;
  for (int step = 0; step < 130; step++) {
    world->Update();
    mirror->Update();
    nearest = std::min(nearest, robots[0]->GetPose().Distance(robots[1]->GetPose()));
    for (size_t i = 0; i < 2; i++) {
      const Pose a = robots[i]->GetPose(), b = mirrored[i]->GetPose();
      ASSERT_EQ(a.x, b.x) << step;
      ASSERT_EQ(a.y, -b.y) << step;
      ASSERT_EQ(a.a, -b.a) << step;
      ASSERT_FALSE(robots[i]->Stalled());
    }
  }
  EXPECT_GT(nearest, 0.5);
  EXPECT_LT(robots[0]->GetPose().Distance(Pose(3, 0.05, 0, 0)), 0.25);
  EXPECT_LT(robots[1]->GetPose().Distance(Pose(-3, -0.05, 0, 0)), 0.25);
}

TEST(BuiltInControllers, APedestrianAloneApproachesItsSpeedAsTheRelaxationSays) {
  // dv/dt = (speed - v) / time, in steps of 0.1 s.
  const auto world = LoadSeeded(
      "position( drive \"omni\" velocity_bounds [-9 9 -9 9 0 0 -90 90] ctrl \"stage/pedestrian "
      "x=50 y=0 speed=2 time=0.8\" )",
      1);
  const ModelPosition& robot = *RobotsOf(*world)[0];
  double v = 0;
  for (int i = 0; i < 50; i++) {
    world->Update();
    EXPECT_NEAR(robot.GetVelocity().x, v, 1e-12) << i;
    v += 0.1 * (2 - v) / 0.8;
  }
}

TEST(BuiltInControllers, APedestrianWalksThroughADoorWithoutTouchingItsPosts) {
  const auto world = LoadSeeded(
      "contacts \"cells\"\nmodel( size [0.2 3 1] pose [0 2.1 0 0] )\n"
      "model( size [0.2 3 1] pose [0 -2.1 0 0] )\n"
      "position( size [0.3 0.3 0.3] pose [-3 0.5 0 0] ctrl \"stage/pedestrian x=3 y=0.2 speed=1\"\n"
      "  ranger( pose [0 0 -0.1 0] sensor( range [0 4] fov 360 samples 73 ) ) )\n",
      1);
  const ModelPosition& robot = *RobotsOf(*world)[0];
  for (int i = 0; i < 150; i++) {
    world->Update();
    ASSERT_FALSE(robot.Stalled()) << i << " at " << robot.GetPose().x << " " << robot.GetPose().y;
  }
  EXPECT_LT(robot.GetPose().Distance(Pose(3, 0.2, 0, 0)), 0.25);
}

TEST(BuiltInControllers, TheExponentialIsExactToEightDigits) {
  for (double x = -20; x <= 20; x += 0.037)
    EXPECT_NEAR(row_exponential(x) / std::exp(x), 1, 1e-8) << x;
}

// ---- World objects and rows ----

/// Steps a pool and worlds alone, with snapshots and resets; they must be equal.
void ExpectRowsEqualWorlds(const std::string& text, unsigned threads) {
  const std::vector<uint64_t> seeds = {1, 2, 3, 4, 5, 6, 7};
  WorldPoolOptions options;
  options.threads = threads;
  WorldPool pool(*LoadSeeded(text, 9), seeds, options);
  ASSERT_EQ(pool.WhyNotClosed(0), "");
  std::vector<std::unique_ptr<World>> alone;
  for (const uint64_t seed : seeds) alone.push_back(LoadSeeded(text, seed));
  std::set<uint64_t> hashes;
  for (int round = 0; round < 12; round++) {
    pool.Step(pool.All(), 25);
    for (const auto& world : alone)
      for (int i = 0; i < 25; i++) ASSERT_FALSE(world->Update());
    if (round == 4) {
      pool.Reset({3}, {77});
      alone[3] = LoadSeeded(text, 77);
    }
    if (round == 6) {
      Snapshot of_pool, of_alone;
      ASSERT_TRUE(pool.Take(0, &of_pool));
      ASSERT_TRUE(alone[0]->Take(&of_alone));
      EXPECT_EQ(of_pool.hash(), of_alone.hash());
      pool.Restore({2}, of_pool);
      ASSERT_TRUE(alone[2]->Restore(of_alone));
    }
    if (round == 8) pool.At(1);
    if (round == 10) pool.Release({1});
    for (const uint32_t id : pool.All()) {
      ASSERT_EQ(pool.Failure(id), "");
      ASSERT_EQ(pool.StateHashes({id})[0], alone[id]->StateHash()) << round << " world " << id;
      EXPECT_EQ(PoolAccess::HasWorld(pool, id), id == 1 && round >= 8 && round < 10)
          << pool.WhyNotClosed(id);
      hashes.insert(alone[id]->StateHash());
    }
  }
  EXPECT_GT(hashes.size(), 50u);
}

std::string ExampleText(const std::string& name) {
  const char* const source = std::getenv("STAGE_SOURCE_DIR");
  std::ifstream file(std::string(source ? source : ".") + "/examples/batch_controller/" + name);
  EXPECT_TRUE(file.is_open()) << name;
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(ExampleWorlds, PedestriansCrossACorridorWithoutTouchingAnything) {
  const auto world = LoadSeeded(ExampleText("crossing.world"), 1);
  for (int i = 0; i < 400; i++) {
    ASSERT_FALSE(world->Update());
    for (const ModelPosition* robot : RobotsOf(*world)) ASSERT_FALSE(robot->Stalled()) << i;
  }
  for (const ModelPosition* robot : RobotsOf(*world)) {
    const double goal = robot->TokenStr()[0] == 'e' ? 5 : -5;
    EXPECT_NEAR(robot->GetPose().x, goal, 0.5) << robot->TokenStr();
  }
}

TEST(ExampleWorlds, RobotsOfTheConvoyFollowTheirHead) {
  const auto world = LoadSeeded(ExampleText("convoy.world"), 1);
  const std::vector<ModelPosition*> robots = RobotsOf(*world);
  double way = 0;
  for (int i = 0; i < 600; i++) {
    const Pose before = robots[0]->GetPose();
    ASSERT_FALSE(world->Update());
    way += before.Distance(robots[0]->GetPose());
    for (size_t k = 1; k < robots.size(); k++)
      ASSERT_LT(robots[k]->GetPose().Distance(robots[k - 1]->GetPose()), 1.3) << i << " " << k;
  }
  EXPECT_GT(way, 5);
}

class BatchControllers : public testing::TestWithParam<unsigned> {};

TEST_P(BatchControllers, RowsOfBuiltInControllersEqualWorlds) {
  ExpectRowsEqualWorlds(Room("stage/wander"), GetParam());
  ExpectRowsEqualWorlds(Room("stage/wander speed=0.6 turn=0.9", kNoisy), GetParam());
  ExpectRowsEqualWorlds(Room("stage/disperse", kNoisy), GetParam());
  ExpectRowsEqualWorlds(Room("stage/goal x=1.5 y=0.5", kNoisy), GetParam());
  ExpectRowsEqualWorlds(Room("stage/pedestrian x=0.5 y=-1.5 speed=0.6", kNoisy), GetParam());
  ExpectRowsEqualWorlds(Room("stage/pedestrian x=0.5 y=-1.5\" \"stage/wander", ""), GetParam());
  const std::string route = " near=0.7 wait=0.5 loop=1 goals=-1,-1,1,-1,1,1";
  ExpectRowsEqualWorlds(Room("stage/pedestrian group=3 member=2" + route, kNoisy), GetParam());
  ExpectRowsEqualWorlds(Room("stage/orca" + route, "drive \"omni\""), GetParam());
}

TEST_P(BatchControllers, RowsOfAPluginEqualWorlds) {
  ExpectRowsEqualWorlds(Room(Herd()), GetParam());
  ExpectRowsEqualWorlds(Room(Herd() + " speed=0.5", kNoisy), GetParam());
  ExpectRowsEqualWorlds(ExampleText("convoy.world"), GetParam());
  ExpectRowsEqualWorlds(Room("stage/wander\" \"" + Herd(), "drive \"omni\""), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Threads, BatchControllers, testing::Values(1u, 2u, 5u));

TEST(BatchControllersInWorlds, ThreadsChangeNoResult) {
  for (const std::string& ctrl :
       {std::string("stage/wander"), std::string("stage/disperse"), Herd(),
        std::string("stage/pedestrian x=0.5 y=-1.5\" \"stage/wander")}) {
    const std::string text = Room(ctrl, kNoisy);
    const auto one = LoadSeeded(text, 3), many = LoadSeeded(text, 3, 4);
    for (int i = 0; i < 200; i++) {
      ASSERT_FALSE(one->Update());
      ASSERT_FALSE(many->Update());
      ASSERT_EQ(one->StateHash(), many->StateHash()) << ctrl << " " << i;
    }
    EXPECT_GT(many->engine().shared_jobs(), 0u);
  }
}

TEST(BatchControllersInWorlds, MemoryAndRandomNumbersAreInSnapshots) {
  const std::string text = Room(Herd());
  const auto world = LoadSeeded(text, 3), copy = LoadSeeded(text, 4);
  for (int i = 0; i < 100; i++) world->Update();
  Snapshot snapshot;
  ASSERT_TRUE(world->Take(&snapshot));
  ASSERT_TRUE(copy->Restore(snapshot));
  EXPECT_EQ(copy->StateHash(), world->StateHash());
  for (int i = 0; i < 100; i++) {
    world->Update();
    copy->Update();
  }
  EXPECT_EQ(copy->StateHash(), world->StateHash());
}

TEST(BatchControllersInWorlds, ADeletedRobotIsNotDrivenAndARestoredOneIs) {
  const std::string text = Room(Herd());
  const auto world = LoadSeeded(text, 3), twin = LoadSeeded(text, 3);
  for (int i = 0; i < 10; i++) world->Update();
  Snapshot snapshot;
  ASSERT_TRUE(world->Take(&snapshot));
  delete RobotsOf(*world)[1];
  for (int i = 0; i < 10; i++) ASSERT_FALSE(world->Update());
  delete RobotsOf(*world)[0]->GetChildren()[0];  // its ranger
  for (int i = 0; i < 10; i++) ASSERT_FALSE(world->Update());
  ASSERT_TRUE(world->Restore(snapshot));
  for (int i = 0; i < 10; i++) twin->Update();
  for (int i = 0; i < 50; i++) {
    world->Update();
    twin->Update();
  }
  EXPECT_EQ(world->StateHash(), twin->StateHash());
}

TEST(BatchControllersInWorlds, RobotsAreDrivenInTheStepsInWhichTheyUpdate) {
  const auto world = LoadSeeded(
      "position( name \"r\" update_interval 300 ctrl \"stage/wander\"\n"
      "  ranger( sensor( range [0 3] fov 180 samples 20 ) ) )\n",
      1);
  ModelPosition& robot = *RobotsOf(*world)[0];
  std::vector<double> speeds;
  for (int i = 0; i < 6; i++) {
    world->Update();
    speeds.push_back(robot.GetVelocity().x);
  }
  EXPECT_EQ(speeds, (std::vector<double>{0, 0, 0, 0, 0, 0.4}));
}

// ---- registration and clients ----

class Stands : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    if (!setup->words().empty()) throw 42;
    return nullptr;
  }
  void Step(const ControllerBatch& batch) const override {
    if (batch.time[0] > 1) throw std::runtime_error("out of order");
  }
};

TEST(RegisteredBatchControllers, AreFoundByNameAndThrowAsOtherControllers) {
  static const Stands stands;
  InitLibrary();
  ASSERT_TRUE(RegisterBatchController("stands", &stands));
  EXPECT_FALSE(RegisterBatchController("stands", &stands));
  EXPECT_FALSE(RegisterBatchController("stage/wander", &stands));
  EXPECT_EQ(
      TryToLoad("position( name \"r\" ctrl \"stands up\" )").errors,
      "t.world:1:25: controller \"stands\" of the model \"r\": it has thrown the number 42\n");
  const auto world = LoadSeeded("position( ctrl \"stands\" )", 1);
  for (int i = 0; i < 10; i++) world->Update();
  EXPECT_THROW(world->Update(), std::runtime_error);
  WorldPool pool(*world, {1, 2});
  EXPECT_EQ(pool.WhyNotClosed(0), "");
  pool.Step(pool.All(), 20);
  for (const uint32_t id : pool.All())
    EXPECT_NE(pool.Failure(id).find("out of order"), std::string::npos) << pool.Failure(id);
}

TEST(RegisteredBatchControllers, AreCountedByExplain) {
  const auto world = LoadSeeded(
      "position( ctrl [\"stage/goal x=1 y=1\" \"stage/goal x=2 y=1\"] )\nposition()\n", 1);
  EXPECT_EQ(Summarize(*world).with_controller, 1u);
}

TEST(BatchControllersInWorlds, ACommandOfAClientCountsForOneStep) {
  const auto world = LoadSeeded("position( ctrl \"stage/goal x=9 y=0\" )", 1);
  ModelPosition& robot = *RobotsOf(*world)[0];
  std::vector<double> speeds;
  for (int i = 0; i < 4; i++) {
    if (i == 2) robot.SetSpeed(-0.2, 0, 0);
    world->Update();
    speeds.push_back(robot.GetVelocity().x);
  }
  EXPECT_EQ(speeds, (std::vector<double>{0, 0.4, -0.2, 0.4}));
}

// ---- mistakes ----

void ExpectError(const std::string& ctrl, const std::string& reason) {
  const LoadOutcome outcome =
      TryToLoad("position( name \"r\"\n  ctrl \"" + ctrl +
                "\"\n  ranger( sensor( range [0 3] fov 180 samples 20 ) ) )\n");
  EXPECT_FALSE(outcome.loaded);
  EXPECT_EQ(outcome.status, 255);
  const std::string name = ctrl.substr(0, ctrl.find(' '));
  EXPECT_EQ(outcome.errors,
            "t.world:2:8: controller \"" + name + "\" of the model \"r\": " + reason + "\n");
}

TEST(BatchControllerArguments, MistakesAreReportedInOneLine) {
  ExpectError("stage/goal x=1", "found no argument y, expected y=NUMBER");
  ExpectError("stage/pedestrian x=1 y=2 time=0",
              "found \"time=0\", expected a number from 0.001 to 1000");
  ExpectError("stage/wander speed=fast", "found \"speed=fast\", expected a number from 0 to 1000");
  ExpectError("stage/wander speed=-1", "found \"speed=-1\", expected a number from 0 to 1000");
  ExpectError("stage/wander speed=0x1", "found \"speed=0x1\", expected a number from 0 to 1000");
  ExpectError("stage/wander speed",
              "found the argument \"speed\", expected speed=NUMBER, slow=NUMBER, turn=NUMBER, "
              "front=NUMBER, stop=NUMBER");
}

TEST(BatchControllerArguments, UnknownBuiltInNamesAreReportedWithTheKnownOnes) {
  const std::string errors = TryToLoad("position( ctrl \"stage/wandr\" )").errors;
  EXPECT_NE(errors.find("controller \"stage/wandr\" can't be loaded"), std::string::npos) << errors;
  EXPECT_NE(errors.find("; built-in controllers are stage/behaviour, stage/disperse, stage/goal, "
                        "stage/orca, stage/pedestrian, "
                        "stage/wander\n"),
            std::string::npos)
      << errors;
}

TEST(BatchControllerArguments, WrongModelsAreReportedInOneLine) {
  EXPECT_EQ(TryToLoad("model( name \"m\" ctrl \"stage/wander\" )").errors,
            "t.world:1:22: controller \"stage/wander\" of the model \"m\": found a model of type "
            "\"model\", expected a position: this controller drives robots\n");
  EXPECT_EQ(
      TryToLoad("position( name \"m\" ctrl \"stage/wander\" )").errors,
      "t.world:1:25: controller \"stage/wander\" of the model \"m\": found none of ranger:0 to "
      "ranger:15 with more than 8 samples, expected one\n");
}

}  // namespace
}  // namespace Stg
