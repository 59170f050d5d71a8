// SPDX-License-Identifier: GPL-2.0-or-later
//
// Whole runs of the stock controllers.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/model_testing.hh"

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// ---- whole runs

/// A world that has not been run yet.
class ControllerRun : public testing::Test {
 protected:
  void SetUp() override { Stg::Init(nullptr, nullptr); }

  void Load(const std::string& text) {
    std::istringstream content(text);
    ASSERT_TRUE(world_.Load(content));
  }

  void RunUntil(double seconds) {
    while (world_.SimTimeNow() < static_cast<Stg::usec_t>(std::llround(seconds * 1e6)))
      ASSERT_FALSE(world_.Update());
  }

  Stg::Pose PoseOf(const std::string& name) {
    const Stg::Model* model = world_.GetModel(name);
    return model ? model->GetGlobalPose() : Stg::Pose(1e9, 1e9, 1e9, 1e9);
  }

  void ExpectPose(const std::string& name, double seconds, const Stg::Pose& expected,
                  double tolerance) {
    RunUntil(seconds);
    const Stg::Pose pose = PoseOf(name);
    EXPECT_NEAR(pose.x, expected.x, tolerance) << name << " at " << seconds << " s";
    EXPECT_NEAR(pose.y, expected.y, tolerance) << name << " at " << seconds << " s";
    if (tolerance < 0.01) {
      EXPECT_NEAR(pose.a, expected.a, tolerance) << name << " at " << seconds << " s";
    }
  }

  Stg::World world_;
};

const char kBox[] =
    "model( size [10 0.2 1] pose [0  5 0 0] ) model( size [0.2 10 1] pose [ 5 0 0 0] )\n"
    "model( size [10 0.2 1] pose [0 -5 0 0] ) model( size [0.2 10 1] pose [-5 0 0 0] )\n";
const char kLaser[] = "ranger( pose [0 0 -0.1 0] sensor( range [0 8] fov 350 samples 350 ) )";

std::string RingText(int count) {
  std::string text = "ranger( pose [0 0 -0.1 0]";
  for (int i = 0; i < count; i++)
    text += " sensor( range [0 5] samples 1 pose [0 0 0 " + std::to_string(i * 360 / count) + "] )";
  return text + " )";
}

/// World text of 16 robots close together in a corner of the box.
std::string Crowd(const std::string& sensors) {
  std::string text = kBox;
  for (int i = 0; i < 16; i++) {
    const int column = i % 4, row = i / 4;
    text += "position( size [0.3 0.3 0.3] pose [" + std::to_string(-4 + 0.6 * column) + " " +
            std::to_string(-4 + 0.6 * row) + " 0 " + std::to_string(i * 77 % 360) +
            "] ctrl \"disperse\" " + sensors + " )\n";
  }
  return text;
}

std::vector<Stg::ModelPosition*> RobotsOf(const Stg::World& world) {
  std::vector<Stg::ModelPosition*> robots;
  for (Stg::Model* model : world.GetChildren())
    if (auto* robot = dynamic_cast<Stg::ModelPosition*>(model)) robots.push_back(robot);
  return robots;
}

double LeastDistance(const std::vector<Stg::ModelPosition*>& robots) {
  double least = kInfinity;
  for (const auto* a : robots)
    for (const auto* b : robots)
      if (a != b) least = std::min(least, a->GetPose().Distance(b->GetPose()));
  return least;
}

TEST_F(ControllerRun, WanderMovesFromTheSecondStepOn) {
  Load("position( name \"r\" pose [0 0 0 0] ctrl \"wander\" " + std::string(kLaser) + " )");
  ExpectPose("r", 0.1, Stg::Pose(0, 0, 0, 0), 1e-9);
  ExpectPose("r", 5.1, Stg::Pose(2, 0, 0, 0), 1e-9);
}

TEST_F(ControllerRun, WanderStaysClearOfWalls) {
  Load(std::string(kBox) +
       "position( name \"r\" size [0.3 0.3 0.3] pose [0 0 0 30] ctrl \"wander\" " + kLaser + " )");
  double way = 0;
  for (int second = 1; second <= 120; second++) {
    const Stg::Pose before = PoseOf("r");
    RunUntil(second);
    way += PoseOf("r").Distance(before);
    ASSERT_FALSE(world_.GetModel("r")->Stalled()) << second;
  }
  EXPECT_GT(way, 12);
}

TEST_F(ControllerRun, DisperseSpreadsACrowdAndRests) {
  for (const std::string& sensors : {std::string(kLaser), RingText(24)}) {
    Load(Crowd(sensors));
    const auto robots = RobotsOf(world_);
    ASSERT_EQ(robots.size(), 16u);
    int stalls = 0;
    for (int step = 0; step < 1200; step++) {
      world_.Update();
      for (const auto* robot : robots) stalls += robot->Stalled();
    }
    EXPECT_GT(LeastDistance(robots), 0.9) << sensors;  // 0.6 at the start
    EXPECT_LT(stalls, 20) << sensors;                  // of 19200
    double speed = 0;
    for (const auto* robot : robots) speed += std::fabs(robot->GetVelocity().x);
    // With sonars, robots keep moving, as others enter and leave the gaps between beams.
    EXPECT_LT(speed / 16, sensors == kLaser ? 0.01 : 0.15) << sensors;
    world_.UnLoad();
  }
}

double MeanDistanceToTheNearest(const std::vector<Stg::ModelPosition*>& robots) {
  double sum = 0;
  for (const auto* a : robots) {
    double nearest = kInfinity;
    for (const auto* b : robots)
      if (a != b) nearest = std::min(nearest, a->GetPose().Distance(b->GetPose()));
    sum += nearest;
  }
  return sum / static_cast<double>(robots.size());
}

// Walls used to press a crowd together in the middle, to 0.7 of the distance.
TEST_F(ControllerRun, DisperseKeepsADispersedCrowd) {
  std::string text = kBox;
  for (int i = 0; i < 16; i++) {
    const int column = i % 4, row = i / 4;
    const double x = 2.4 * column - 3.6 + 0.2 * (i * 7 % 5 - 2);
    const double y = 2.4 * row - 3.6 + 0.2 * (i * 3 % 5 - 2);
    text += "position( size [0.3 0.3 0.3] pose [" + std::to_string(x) + " " + std::to_string(y) +
            " 0 " + std::to_string(i * 77 % 360) + "] ctrl \"disperse\" " + kLaser + " )\n";
  }
  Load(text);
  const auto robots = RobotsOf(world_);
  const double before = MeanDistanceToTheNearest(robots);
  RunUntil(120);
  EXPECT_GT(MeanDistanceToTheNearest(robots), before);
}

TEST_F(ControllerRun, DisperseFillsTheRoomFromACorner) {
  Load(Crowd(kLaser));
  RunUntil(180);
  // Spread evenly, the 16 robots are 2.4 m apart.
  EXPECT_GT(MeanDistanceToTheNearest(RobotsOf(world_)), 0.8 * 2.4);
}

TEST_F(ControllerRun, DisperseObeysItsArguments) {
  Load(std::string(kBox) + "position( name \"r\" pose [-4 0 0 0] size [0.3 0.3 0.3]" +
       " ctrl \"disperse speed=0.1 horizon=8\" " + kLaser + " )");
  RunUntil(5);
  EXPECT_NEAR(PoseOf("r").x, -4 + 4.9 * 0.1, 0.02);
}

TEST_F(ControllerRun, DisperseDoesNotDependOnThreads) {
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 2}) {
    Stg::World::run_options.threads = threads;
    Stg::World world;
    std::istringstream content(Crowd(kLaser));
    ASSERT_TRUE(world.Load(content));
    for (int step = 0; step < 100; step++) world.Update();
    hashes.push_back(world.StateHash());
  }
  Stg::World::run_options.threads = 0;
  EXPECT_EQ(hashes[0], hashes[1]);
}

using ControllerRefusals = ControllerRun;

/// Expects that loading fails with the message and does not end the process.
void ExpectRefusal(const std::string& text, const char* message) {
  Stg::World world;
  const Stg::LoadOutcome outcome = Stg::TryToLoad(&world, text);
  EXPECT_FALSE(outcome.loaded) << text;
  EXPECT_EQ(outcome.status, 255) << text;
  EXPECT_TRUE(std::regex_search(outcome.errors, std::regex(message))) << outcome.errors;
}

TEST_F(ControllerRefusals, ControllersGiveUpWithAMessage) {
  const std::string end = std::string(" ") + kLaser + " )";
  const std::string bare = " ranger() )";
  ExpectRefusal("model( name \"box\" ctrl \"wander\"" + end,
                "wander: box: found a model of type model, expected a position");
  ExpectRefusal("position( ctrl \"wander\" )", "wander: position:0: found none of ranger:0");
  ExpectRefusal("position( ctrl \"wander\"" + bare, "wander: position:0: found none of ranger:0");
  ExpectRefusal("position( ctrl \"wander\" " + RingText(16) + " )", "more than 8 samples");
  ExpectRefusal("model( ctrl \"disperse\"" + end, "disperse: model:. found|expected a position");
  ExpectRefusal("position( ctrl \"disperse\" )", "disperse: position:0: found no ranger");
  ExpectRefusal("position( ctrl \"disperse speeed=1\"" + end, "found the argument \"speeed=1\"");
  ExpectRefusal("position( ctrl \"disperse speed=x\"" + end, "found \"speed=x\"");
  ExpectRefusal("position( ctrl \"expand_swarm\"" + end, "expected 12");
  ExpectRefusal("position( ctrl \"expand_swarm\" )", "expand_swarm: position:0: found no ranger");
  ExpectRefusal("position( ctrl \"expand_pioneer\"" + end, "expected 16");
}

// ---- reference runs, with worlds that are not part of this project

class ReferenceRun : public ControllerRun {
 protected:
  void SetUp() override {
    ControllerRun::SetUp();
    const char* folder = std::getenv("STAGE_SHARED_DIR");
    if (folder) worlds_ = std::string(folder) + "/stage-worlds/";
    if (!folder || !std::filesystem::exists(worlds_ + "simple.world"))
      GTEST_SKIP() << "needs STAGE_SHARED_DIR/stage-worlds";
  }

  std::string Cave() const {
    return "include \"" + worlds_ + "map.inc\"\ninclude \"" + worlds_ +
           "pioneer.inc\"\ninclude \"" + worlds_ +
           "sick.inc\"\nresolution 0.02\nfloorplan( size [16 16 0.6] bitmap \"" + worlds_ +
           "bitmaps/cave.png\" )\n";
  }

  std::string worlds_;
};

TEST_F(ReferenceRun, Wander) {
  ASSERT_TRUE(world_.Load(worlds_ + "simple.world"));
  ExpectPose("r0", 0.1, Stg::Pose(-6.9460, -6.9470, 0, 0.7854), 1e-3);
  ExpectPose("r1", 0.1, Stg::Pose(-3.9460, -6.9470, 0, 0.7854), 1e-3);
  ExpectPose("r0", 5.1, Stg::Pose(-5.5318, -5.5328, 0, 0.7854), 1e-3);
  ExpectPose("r1", 5.1, Stg::Pose(-2.5318, -5.5328, 0, 0.7854), 1e-3);
}

TEST_F(ReferenceRun, ExpandPioneer) {
  Load(Cave() + "pioneer2dx( name \"r\" pose [-6 4 0 0] sicklaser() ctrl \"expand_pioneer\" )\n");
  ExpectPose("r", 1.1, Stg::Pose(-5.9890, 3.9833, 0, -0.8767), 0.05);
  ExpectPose("r", 2.1, Stg::Pose(-5.9775, 3.9669, 0, -0.7922), 0.05);
  ExpectPose("r", 5.1, Stg::Pose(-5.9292, 3.9032, 0, -0.9416), 0.05);
}

TEST_F(ReferenceRun, ExpandSwarm) {
  std::string ring = "ranger( pose [0 0 -0.05 0]";
  for (int i = 0; i < 12; i++)
    ring += " sensor( range [0 2] fov 30 samples 1 pose [0 0 0 " + std::to_string(30 * i) + "] )";
  Load(Cave() + "position( name \"r\" size [0.1 0.1 0.1] pose [-6 4 0 0] ctrl \"expand_swarm\" " +
       ring + " ) )\n");
  ExpectPose("r", 1.1, Stg::Pose(-6.0000, 4.0000, 0, 1.5708), 0.05);
  ExpectPose("r", 3.1, Stg::Pose(-6.2444, 4.1131, 0, 2.8415), 0.05);
  ExpectPose("r", 5.1, Stg::Pose(-6.4693, 4.1955, 0, 1.3188), 0.05);
}

}  // namespace
