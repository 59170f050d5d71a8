// SPDX-License-Identifier: GPL-2.0-or-later
//
// The ranges of RayCaster equal the readings of rangers and the results of World::Raytrace().

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "raytrace_testing.hh"
#include "sensing/fan.hh"
#include "stage.hh"
#include "support/random_source.hh"
#include "support/shipped_worlds.hh"
#include "world/engine.hh"
#include "world/statistics.hh"

namespace Stg {
namespace {

using test::RandomSource;

std::unique_ptr<World> LoadShipped(const char* name, const RunOptions& options = RunOptions()) {
  InitLibrary();
  auto world = std::make_unique<World>(options);
  EXPECT_TRUE(world->Load(SourceFile(std::string("worlds/") + name)));
  return world;
}

std::vector<Pose> RandomPoses(RandomSource* random, size_t count, double reach) {
  std::vector<Pose> poses;
  for (size_t i = 0; i < count; i++)
    poses.emplace_back(random->Real(-reach, reach), random->Real(-reach, reach), 0,
                       random->Real(-4, 4));
  return poses;
}

bool IsScenery(Model* candidate, const Model*, const void*) {
  return !dynamic_cast<ModelPosition*>(candidate->Root()) && !(candidate->vis.ranger_return < 0);
}

/// Compares cast rays with the readings of sensors that see no other robot.
void CompareWithRangers(const char* file, RayModel ray_model) {
  RunOptions options;
  options.ray_model = ray_model;
  const std::unique_ptr<World> world = LoadShipped(file, options);
  for (int i = 0; i < 20; i++) world->Update();
  size_t compared = 0;
  for (Model* model : world->GetAllModels()) {
    auto* const ranger = dynamic_cast<ModelRanger*>(model);
    if (!ranger) continue;
    // Readings are taken at the pose before the last move.
    Snapshot now;
    ASSERT_TRUE(world->Take(&now));
    const Pose frame = ranger->SensorFrame(ranger->GetGlobalPose());
    world->Update();
    ASSERT_EQ(ranger->GetInterval(), world->sim_interval);
    for (const ModelRanger::Sensor& sensor : ranger->GetSensors()) {
      const std::vector<meters_t> ranges = sensor.ranges;
      const Pose origin = ModelRanger::OriginOf(sensor, frame, SinCos(frame.a));
      const std::vector<double> bearings = sensor.bearings;
      ASSERT_TRUE(world->Restore(now));
      CastOptions cast;
      cast.z = origin.z;
      cast.robots = true;
      cast.from = ranger;
      std::vector<double> found(bearings.size());
      ASSERT_TRUE(
          RayCaster(world.get(), cast).Cast(&origin, 1, bearings, sensor.Reach(), found.data()));
      EXPECT_EQ(found, ranges) << ranger->TokenStr();
      compared += found.size();
      break;
    }
    ASSERT_TRUE(world->Restore(now));
    if (compared > 5000) break;
  }
  EXPECT_GT(compared, 500u);
}

TEST(RayCaster, EqualsRangers) {
  CompareWithRangers("cave.world", RayModel::kCell);
  CompareWithRangers("hospital.world", RayModel::kCell);
}

/// Rays that ignore robots cost no more than others: none stops at a robot and resumes.
TEST(RayCaster, MapRaysDoNotStopAtRobots) {
  for (const RayModel model : {RayModel::kCell, RayModel::kExact}) {
    RunOptions run;
    run.ray_model = model;
    const std::unique_ptr<World> world = LoadShipped("cave.world", run);
    CastOptions options;
    RayCaster caster(world.get(), options);
    std::vector<Pose> poses;
    for (Model* robot : world->GetAllModels())
      if (robot->Drives()) poses.push_back(robot->GetGlobalPose());
    ASSERT_GT(poses.size(), 10u);
    std::vector<double> bearings(60), ranges(poses.size() * bearings.size());
    for (size_t i = 0; i < bearings.size(); i++) bearings[i] = static_cast<double>(i) * 0.1;
    constexpr double kReach = 100;  // metres; all walls are nearer
    const auto before = world->statistics().trace;
    ASSERT_TRUE(caster.Cast(poses.data(), poses.size(), bearings, kReach, ranges.data()));
    const auto after = world->statistics().trace;
    EXPECT_EQ(after.rays - before.rays, ranges.size());
    const auto hits = static_cast<uint64_t>(
        std::ranges::count_if(ranges, [](double range) { return range < kReach; }));
    EXPECT_GT(hits, ranges.size() / 2);
    // The exact model also examines cells in which the ray hits nothing.
    if (model == RayModel::kCell) {
      EXPECT_EQ(after.potential_hits - before.potential_hits, hits);
    }
  }
}

/// A box does not belong to the map while a robot carries it.
TEST(RayCaster, MapChangesWithWhatStandsOnRobots) {
  InitLibrary();
  World world;
  std::istringstream file(
      "position( name \"r\" pose [5 5 0 0] size [0.4 0.4 0.4] ) model( name \"box\" pose [2 0 0 0] "
      "size [0.2 0.2 0.2] )");
  ASSERT_TRUE(world.Load(file));
  const auto range = [&world] {
    double found = 0;
    const Pose origin(0, 0, 0, 0);
    EXPECT_TRUE(RayCaster(&world).Cast(&origin, 1, {0.0}, 8.0, &found));
    return found;
  };
  Model* const box = world.GetModel("box");
  EXPECT_NEAR(range(), 1.9, 0.03);
  box->SetParent(world.GetModel("r"));
  EXPECT_EQ(range(), 8);
  box->SetParent(nullptr);
  EXPECT_NEAR(range(), 1.9, 0.03);
  box->SetRangerReturn(-1);
  EXPECT_EQ(range(), 8);
}

TEST(RayCaster, EqualsExactRangers) { CompareWithRangers("cave.world", RayModel::kExact); }

/// Compares rays from random poses, with several numbers of threads.
TEST(RayCaster, EqualsRaytrace) {
  RandomSource random(7);
  const std::vector<Pose> poses = RandomPoses(&random, 3000, 9);
  std::vector<double> bearings;
  for (int i = 0; i < 7; i++) bearings.push_back(random.Real(-3, 3));
  for (const double range : {2.0, 500.0, kInfinity})
    for (const int threads : {1, 3}) {
      RunOptions options;
      options.threads = threads;
      const std::unique_ptr<World> world = LoadShipped("cave.world", options);
      std::vector<double> found(poses.size() * bearings.size());
      ASSERT_TRUE(
          RayCaster(world.get()).Cast(poses.data(), poses.size(), bearings, range, found.data()));
      for (size_t i = 0; i < poses.size(); i++)
        for (size_t k = 0; k < bearings.size(); k++) {
          Pose pose = poses[i];
          pose.a = normalize(pose.a + bearings[k]);
          const double expected =
              world->Raytrace(pose, range, IsScenery, nullptr, nullptr, false).range;
          // The sum of heading and bearing is rounded differently.
          if (std::isinf(expected))
            EXPECT_TRUE(std::isinf(found[i * bearings.size() + k]));
          else
            EXPECT_NEAR(found[i * bearings.size() + k], expected, 0.15) << i << " " << k;
        }
    }
}

TEST(RayCaster, ObeysItsOptions) {
  const std::unique_ptr<World> world = EmptyWorld();
  AddBox(world.get(), Size(0.2, 4, 1), Pose(5, 0, 0, 0));
  Model* const low = AddBox(world.get(), Size(0.2, 4, 0.3), Pose(4, 0, 0, 0));
  Model* const robot = world->CreateModel(nullptr, "position");
  robot->SetPose(Pose(2, 0, 0, 0));
  robot->SetGeom(Geom(Pose(), Size(0.4, 0.4, 1)));
  const Pose here;
  const auto range = [&](const CastOptions& options) {
    double found = -1;
    EXPECT_TRUE(RayCaster(world.get(), options).Cast(&here, 1, {0.0}, 8, &found));
    return found;
  };
  CastOptions options;
  EXPECT_NEAR(range(options), 3.9, 0.03);  // any height, no robots
  options.z = 0.5;
  EXPECT_NEAR(range(options), 4.9, 0.03);
  options.robots = true;
  EXPECT_NEAR(range(options), 1.8, 0.03);
  options.from = robot;
  EXPECT_NEAR(range(options), 4.9, 0.03);
  options.z = 0.2;
  EXPECT_NEAR(range(options), 3.9, 0.03);
  low->SetRangerReturn(-1);
  EXPECT_NEAR(range(options), 4.9, 0.03);
}

TEST(RayCaster, OddArguments) {
  const std::unique_ptr<World> world = EmptyWorld();
  AddBox(world.get(), Size(0.2, 4, 1), Pose(5, 0, 0, 0));
  RayCaster caster(world.get());
  EXPECT_TRUE(caster.Cast(nullptr, 0, {0.0}, 8, nullptr));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Pose poses[] = {Pose(), Pose(nan, 0, 0, 0), Pose(0, kInfinity, 0, 0), Pose(0, 0, 0, nan),
                        Pose(1e300, 0, 0, 0)};
  EXPECT_TRUE(caster.Cast(poses, 5, {}, 8, nullptr));
  std::vector<double> found(5);
  EXPECT_TRUE(caster.Cast(poses, 5, {0.0}, 8, found.data()));
  EXPECT_NEAR(found[0], 4.9, 0.03);
  for (size_t i = 1; i < 5; i++) EXPECT_EQ(found[i], 8);
  EXPECT_TRUE(caster.Cast(poses, 1, {nan}, 8, found.data()));  // straight ahead
  EXPECT_NEAR(found[0], 4.9, 0.03);
  EXPECT_TRUE(caster.Cast(poses, 1, {0.0}, -1, found.data()));
  EXPECT_EQ(found[0], -1);
}

int CastInCallback(Model* model, void* told) {
  double range;
  const Pose pose;
  *static_cast<bool*>(told) = RayCaster(model->GetWorld()).Cast(&pose, 1, {0.0}, 8, &range);
  return 0;
}

TEST(RayCaster, IsRefusedInCallbacks) {
  const std::unique_ptr<World> world = EmptyWorld();
  Model* const model = world->CreateModel(nullptr, "position");
  bool told = true;
  model->AddCallback(Model::CB_UPDATE, CastInCallback, &told);
  model->Subscribe();
  testing::internal::CaptureStderr();
  world->Update();
  EXPECT_NE(testing::internal::GetCapturedStderr().find("rays can't be cast"), std::string::npos);
  EXPECT_FALSE(told);
}

/// Casting does not change the world, and dropped data is restored afterwards.
TEST(RayCaster, DoesNotChangeTheWorld) {
  const std::unique_ptr<World> world = LoadShipped("cave.world");
  const std::unique_ptr<World> other = LoadShipped("cave.world");
  RandomSource random(3);
  const std::vector<Pose> poses = RandomPoses(&random, 10, 8);
  std::vector<double> found(poses.size() * 500000);
  for (int i = 0; i < 30; i++) {
    std::vector<double> bearings(i % 3 == 0 ? 500000 : 3);
    for (double& bearing : bearings) bearing = random.Real(-3, 3);
    ASSERT_TRUE(RayCaster(world.get()).Cast(poses.data(), i % 3 + 1u, bearings, 0.3, found.data()));
    world->Update();
    other->Update();
  }
  EXPECT_GT(world->engine().scene.tables.generation(), 0u);
  EXPECT_EQ(world->StateHash(), other->StateHash());
}

}  // namespace
}  // namespace Stg
