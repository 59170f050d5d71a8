// SPDX-License-Identifier: GPL-2.0-or-later
//
// Scans that take time: each ray is cast from where the robot was then.

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "models/scan_path.hh"
#include "ranger_testing.hh"
#include "rows/row_bridge.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

constexpr double kDt = 0.02;
const Velocity kAround(0.4, -0.3, 0, -1.5);  // ahead, to the right and turning

/// A room of 6 m by 4 m around the origin, exact rays, and a robot with a scanner that is mounted
/// off its centre and turned.
std::string Room(const std::string& sensor, const std::string& ranger = "update_interval 100") {
  return "resolution 0.02\ninterval_sim 20\nray_model \"exact\"\n"
         "model( pose [3.1 0 0 0] size [0.2 8 1] )\nmodel( pose [-3.1 0 0 0] size [0.2 8 1] )\n"
         "model( pose [0 2.1 0 0] size [8 0.2 1] )\nmodel( pose [0 -2.1 0 0] size [8 0.2 1] )\n"
         "position( name \"r\" pose [-0.5 0.3 0 20] size [0.3 0.3 0.3] drive \"omni\" alwayson 1\n"
         "  ranger( name \"l\" pose [0.1 0.05 -0.15 30] alwayson 1 " +
         ranger + "\n    sensor( range [0 20] " + sensor + " ) ) )\n";
}

std::unique_ptr<World> MakeWorld(const std::string& text, int threads) {
  RunOptions options = OptionsOf(1);
  options.threads = threads;
  auto world = std::make_unique<World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

/// Loads a text that is refused, and returns the message.
std::string Refusal(const std::string& text) {
  const LoadOutcome outcome = TryToLoad(text);
  EXPECT_FALSE(outcome.loaded) << text;
  return outcome.errors;
}

/// A world, its scanner, and the true poses of its robot at the ends of all steps.
class Sweep {
 public:
  explicit Sweep(const std::string& text, const Velocity& velocity = Velocity(), int threads = 1)
      : world_(MakeWorld(text, threads)) {
    robot_ = dynamic_cast<ModelPosition*>(world_->GetModel("r"));
    ranger_ = dynamic_cast<ModelRanger*>(world_->GetModel("r.l"));
    if (!ranger_) ranger_ = dynamic_cast<ModelRanger*>(robot_->GetChild("ranger:0"));
    robot_->SetSpeed(velocity);
    poses_.push_back(robot_->GetPose());
  }
  void Steps(int count) {
    for (int i = 0; i < count; i++) {
      Step(*world_);
      poses_.push_back(robot_->GetPose());
    }
  }
  /// Steps until the scanner has just updated, at the beginning of the last step.
  void ToNextScan() {
    const usec_t before = ranger_->GetLastUpdate();
    do Steps(1);
    while (ranger_->GetLastUpdate() == before);
  }
  const Sensor& sensor() const { return ranger_->GetSensors().at(0); }
  ModelPosition& robot() { return *robot_; }
  World& world() { return *world_; }
  /// The pose of the robot `seconds` before the last step, interpolated evenly.
  Pose Before(double seconds) const {
    const double steps = seconds / kDt;
    const auto index = static_cast<size_t>(steps);
    const Pose& after = poses_[poses_.size() - 2 - index];
    const Pose& before = poses_[poses_.size() - 3 - index];
    const double part = steps - static_cast<double>(index);
    return Pose(after.x + part * (before.x - after.x), after.y + part * (before.y - after.y), 0,
                after.a + part * normalize(before.a - after.a));
  }
  /// Greatest distance of an end of a ray from the walls, if the poses are those at the times of
  /// rays.
  double Smear(double increment) const {
    double most = 0;
    const size_t count = sensor().ranges.size();
    for (size_t i = 0; i < count; i++) {
      const Pose origin =
          Before(static_cast<double>(count - 1 - i) * increment) + Pose(0.1, 0.05, 0, M_PI / 6);
      const Pose end =
          origin + Pose(0, 0, 0, sensor().bearings[i]) + Pose(sensor().ranges[i], 0, 0, 0);
      most = std::max(most,
                      std::min(std::fabs(3 - std::fabs(end.x)), std::fabs(2 - std::fabs(end.y))));
    }
    return most;
  }

 private:
  std::unique_ptr<World> world_;
  ModelPosition* robot_;
  ModelRanger* ranger_;
  std::vector<Pose> poses_;
};

TEST(RangerSweep, EachRayEndsAtAWallFromWhereTheRobotWasThen) {
  for (const double increment : {0.00001, 0.0001, 0.00025, 0.00027}) {
    for (const Velocity& velocity : {Velocity(0.5, 0, 0, 0), Velocity(0, 0, 0, 2), kAround}) {
      Sweep sweep(Room("fov 350 samples 361 time_increment " + std::to_string(increment)),
                  velocity);
      for (int scan = 0; scan < 3; scan++) sweep.ToNextScan();
      EXPECT_LT(sweep.Smear(increment), 1e-9)
          << increment << " s, velocity " << velocity.x << " " << velocity.a;
    }
  }
}

TEST(RangerSweep, IgnoringTheTimesOfRaysSmearsWalls) {
  Sweep sweep(Room("fov 350 samples 361 time_increment 0.00025"), kAround);
  for (int scan = 0; scan < 3; scan++) sweep.ToNextScan();
  EXPECT_GT(sweep.Smear(0), 0.1);
}

TEST(RangerSweep, AScanWhileTheRobotStandsIsThatOfAllAtOnce) {
  Sweep slow(Room("fov 350 samples 361 time_increment 0.00025"));
  Sweep quick(Room("fov 350 samples 361"));
  slow.ToNextScan();
  quick.ToNextScan();
  EXPECT_EQ(slow.sensor().ranges, quick.sensor().ranges);
}

TEST(RangerSweep, TheMotionOfThePastCountsWhenTheRobotStartsAndStops) {
  Sweep sweep(Room("fov 350 samples 361 time_increment 0.00025"));
  sweep.Steps(7);
  sweep.robot().SetSpeed(0.5, 0.2, 1.5);
  sweep.ToNextScan();
  EXPECT_LT(sweep.Smear(0.00025), 1e-9) << "it began to move in the middle of the scan";
  sweep.robot().SetSpeed(0, 0, 0);
  sweep.ToNextScan();
  EXPECT_LT(sweep.Smear(0.00025), 1e-9) << "it stopped before the scan ended";
  sweep.ToNextScan();
  sweep.ToNextScan();
  EXPECT_LT(sweep.Smear(0), 1e-9) << "it stands";
}

TEST(RangerSweep, NoiseAndDefectsFollowWhenAllRaysAreKnown) {
  const std::string noise = "fov 350 samples 361 noise [0.0001 0.01 0.5] loss 0.2 range_step 0.01";
  Sweep slow(Room(noise + " time_increment 0.00025"));
  Sweep quick(Room(noise));
  slow.ToNextScan();
  quick.ToNextScan();
  EXPECT_EQ(slow.sensor().ranges, quick.sensor().ranges) << "the same random numbers";
  EXPECT_EQ(slow.sensor().intensities, quick.sensor().intensities);

  Sweep moving(Room(noise + " time_increment 0.00025"), kAround);
  for (int scan = 0; scan < 3; scan++) moving.ToNextScan();
  int lost = 0;
  for (const double range : moving.sensor().ranges) {
    lost += range == 20;
    EXPECT_TRUE(range == 20 || std::fabs(range / 0.01 - std::round(range / 0.01)) < 1e-6) << range;
  }
  EXPECT_GT(lost, 30);
  EXPECT_LT(lost, 130);
}

TEST(RangerSweep, SnapshotsHaveTheWay) {
  const std::string text = Room("fov 350 samples 361 time_increment 0.00025");
  Sweep sweep(text, kAround);
  sweep.Steps(9);
  Snapshot state;
  ASSERT_TRUE(sweep.world().Take(&state));
  sweep.robot().SetSpeed(0, 0, 0);
  sweep.ToNextScan();
  const uint64_t hash = sweep.world().StateHash();
  sweep.Steps(50);
  ASSERT_TRUE(sweep.world().Restore(state));
  sweep.robot().SetSpeed(0, 0, 0);
  sweep.ToNextScan();
  EXPECT_EQ(sweep.world().StateHash(), hash);
}

TEST(RangerSweep, ThreadsChangeNoBit) {
  std::string text = Room("fov 350 samples 361 noise [0.0001 0 0.2] time_increment 0.00025");
  for (int i = 0; i < 6; i++)
    text += "position( pose [" + std::to_string(-2 + 0.6 * i) +
            " -1 0 0] size [0.2 0.2 0.2] alwayson 1 velocity [0.1 0 0 90] ranger( alwayson 1 "
            "update_interval 40"
            " sensor( range [0 9] fov 300 samples 200 time_increment 0.0001 ) ) )\n";
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 2, 5}) {
    Sweep sweep(text, Velocity(0.1, 0, 0, 0.9), threads);
    sweep.Steps(40);
    hashes.push_back(sweep.world().StateHash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(RangerSweep, WorldsWithSuchScansAreNotClosed) {
  Sweep sweep(Room("samples 10 time_increment 0.001"));
  EXPECT_NE(RowBridge::WhyNotClosed(sweep.world()).find("time_increment"), std::string::npos);
}

TEST(RangerSweep, MistakesAreRefused) {
  EXPECT_NE(Refusal(Room("samples 10 time_increment -1")).find("time_increment"),
            std::string::npos);
  const std::string long_scan = Refusal(Room("samples 361 time_increment 0.001"));
  EXPECT_NE(
      long_scan.find("found a scan that takes 0.36 s, expected at most the update_interval of "
                     "the ranger, 0.1 s"),
      std::string::npos)
      << long_scan;
  const std::string steps =
      Refusal(Room("samples 361 time_increment 0.06", "update_interval 30000"));
  EXPECT_NE(steps.find("more than 1000 steps"), std::string::npos) << steps;
}

TEST(RangerSweep, APathGoesBackOverStepsThatDiffer) {
  ScanPath path;
  for (int i = 0; i < 5; i++) path.Note(Velocity(i, 0, 0, 0), 3);  // metres per second
  path.StartAt(Pose(10, 0, 0, 0), 0.5);
  EXPECT_EQ(path.Before(0).x, 10);
  EXPECT_EQ(path.Before(0.25).x, 9);
  EXPECT_EQ(path.Before(0.5).x, 8);
  EXPECT_EQ(path.Before(1).x, 6.5);
  EXPECT_EQ(path.Before(1.5).x, 5.5);
  EXPECT_EQ(path.Before(99).x, 5.5) << "no more is known";
}

}  // namespace
}  // namespace Stg
