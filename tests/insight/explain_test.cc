// SPDX-License-Identifier: GPL-2.0-or-later
//
// Summarize() and MeasureStepCosts() of small worlds with figures computed by hand.
// Measuring must leave the state unchanged.

#include <algorithm>
#include <cstdlib>

#include "support/model_testing.hh"

namespace Stg {
namespace {

/// A driven robot with a subscribed ranger and one without subscribers; a model of each kind that
/// rangers do not see; a robot without subscribers.
constexpr char kScene[] = R"(
resolution 0.1
interval_sim 100
position
(
  name "robot" size [0.4 0.4 0.4] pose [-3 0 0 0] alwayson 1
  ranger
  (
    name "eye" pose [0 0 -0.2 0] alwayson 1
    sensor( size [0 0 0] range [0 5] fov 180 samples 90 )
    sensor( size [0 0 0] range [0 5] samples 10 )
  )
  ranger
  (
    name "spare" pose [0 0 -0.1 0] update_interval 250
    sensor( size [0 0 0] range [0 5] samples 8 )
  )
)
position( name "parked" size [0.4 0.4 0.4] pose [-3 2 0 0] )
model( name "wall" size [1 1 1] pose [2 0 0 0] )
model( name "ghost" size [1 1 1] pose [2 2 0 0] ranger_return -1 )
model( name "mat" size [1 1 0.01] pose [2 -2 0 0] )
camera( name "lens" pose [0 0 1 0] resolution [20 10] update_interval 1000 alwayson 1 )
)";

const SensorKind* FindKind(const SceneSummary& s, const std::string& type, bool subscribed) {
  for (const SensorKind& kind : s.sensors)
    if (kind.type == type && kind.subscribed == subscribed) return &kind;
  return nullptr;
}

// ---- the summary --------------------------------------------------------------------------------

TEST(Summary, Models) {
  const SceneSummary s = Summarize(*LoadText(kScene));
  EXPECT_EQ(s.models, 8u);
  ASSERT_EQ(s.types.size(), 4u);
  EXPECT_EQ(s.types[0].type, "model");
  EXPECT_EQ(s.types[0].models, 3u);
  EXPECT_EQ(s.types[0].running, 0u);
  EXPECT_EQ(s.types[1].type, "position");
  EXPECT_EQ(s.types[1].models, 2u);
  EXPECT_EQ(s.types[1].running, 1u);
  EXPECT_EQ(s.robots, 1u);
  EXPECT_EQ(s.undriven, 1u);
  EXPECT_EQ(s.with_controller, 0u);
  EXPECT_EQ(s.step, 100000u);
  EXPECT_DOUBLE_EQ(s.position_updates, 1);
  EXPECT_DOUBLE_EQ(s.updates_per_step, 1 + 1 + 0.1);  // robot, eye, lens
}

TEST(Summary, Sensors) {
  const SceneSummary s = Summarize(*LoadText(kScene));
  ASSERT_EQ(s.sensors.size(), 3u);
  const SensorKind& eye = s.sensors[0];  // sorted: subscribed ones first, then by rays
  EXPECT_EQ(eye.type, "ranger");
  EXPECT_TRUE(eye.subscribed);
  EXPECT_EQ(eye.models, 1u);
  EXPECT_EQ(eye.parts, 2u);
  EXPECT_EQ(eye.rays, 100u);
  EXPECT_EQ(eye.interval, 100000u);
  EXPECT_DOUBLE_EQ(eye.RaysPerStep(), 100);
  const SensorKind& lens = s.sensors[1];
  EXPECT_EQ(lens.type, "camera");
  EXPECT_EQ(lens.pixels, 200u);
  EXPECT_EQ(lens.RaysPerStep(), 0);
  EXPECT_DOUBLE_EQ(lens.updates_per_step, 0.1);
  const SensorKind* spare = FindKind(s, "ranger", false);
  ASSERT_NE(spare, nullptr);
  EXPECT_EQ(spare->models, 1u);
  EXPECT_EQ(spare->example, "robot.spare");
  EXPECT_EQ(spare->rays, 8u);
  EXPECT_DOUBLE_EQ(spare->updates_per_step, 0.4);  // every 250 ms on average
}

TEST(Summary, SubscribingMovesASensorToTheOthers) {
  const auto world = LoadText(kScene);
  Find(*world, "robot.spare")->Subscribe();
  const SceneSummary s = Summarize(*world);
  EXPECT_EQ(FindKind(s, "ranger", false), nullptr);
  ASSERT_EQ(s.sensors.size(), 3u);
  EXPECT_NEAR(s.sensors[1].RaysPerStep(), 8 * 0.4, 1e-12);
  EXPECT_EQ(s.layers, 3u);
}

TEST(Summary, EqualSensorsAreOneKind) {
  std::string text = "interval_sim 100\n";
  for (int i = 0; i < 5; i++)
    text += "ranger( alwayson 1 sensor( samples " + std::string(i < 3 ? "7" : "9") + " ) )\n";
  const SceneSummary s = Summarize(*LoadText(text));
  ASSERT_EQ(s.sensors.size(), 2u);
  EXPECT_EQ(s.sensors[0].models, 3u);  // 21 rays; the others have 18
  EXPECT_EQ(s.sensors[1].models, 2u);
}

TEST(Summary, BodiesThatNoRangerSees) {
  const SceneSummary s = Summarize(*LoadText(kScene));
  EXPECT_EQ(s.bodies, 6u);  // rangers have none
  EXPECT_EQ(s.blocks, 6u);
  EXPECT_EQ(s.corners, 24u);
  EXPECT_EQ(s.hidden_blocks, 1u);      // the ghost
  EXPECT_EQ(s.overlooked_blocks, 2u);  // the mat, and the camera at a height of 1 m
  EXPECT_EQ(s.unseen_bodies, 3u);
  EXPECT_EQ(s.unseen_examples, (std::vector<std::string>{"ghost", "mat", "lens"}));
  EXPECT_EQ(s.looking_everywhere, 1u);
  EXPECT_DOUBLE_EQ(s.body_heights.min, 0);
  EXPECT_DOUBLE_EQ(s.body_heights.max, 1.05);
}

TEST(Summary, ABodyIsSeenIfOneOfItsBlocksIs) {
  const SceneSummary s = Summarize(
      *LoadText("ranger( alwayson 1 pose [-3 0 0.5 0] sensor( size [0 0 0] ) )\n"
                "model( name \"steps\" size [1 1 1]\n"
                "  block( points 3 point[0] [0 0] point[1] [1 0] point[2] [0 1] z [0 0.2] )\n"
                "  block( points 3 point[0] [0 0] point[1] [1 0] point[2] [0 1] z [0.2 1] ) )\n"));
  EXPECT_EQ(s.blocks, 2u);
  EXPECT_EQ(s.overlooked_blocks, 1u);
  EXPECT_EQ(s.unseen_bodies, 0u);
}

TEST(Summary, Heights) {
  const SceneSummary s = Summarize(*LoadText(kScene));
  ASSERT_EQ(s.heights.size(), 2u);
  EXPECT_NEAR(s.heights[0].z, 0.2, 1e-12);
  EXPECT_EQ(s.heights[0].sensors, 2u);
  EXPECT_EQ(s.heights[0].idle_sensors, 0u);
  EXPECT_DOUBLE_EQ(s.heights[0].rays_per_step, 100);
  EXPECT_EQ(s.heights[0].blocks, 3u);  // both robots and the wall
  EXPECT_NEAR(s.heights[1].z, 0.3, 1e-12);
  EXPECT_EQ(s.heights[1].sensors, 0u);
  EXPECT_EQ(s.heights[1].idle_sensors, 1u);
  EXPECT_EQ(s.layers, 2u);
  EXPECT_EQ(s.layer_heights, 1u);
}

TEST(Summary, MoreHeightsThanLayers) {
  std::string text;
  for (int i = 0; i < 12; i++)
    text += "ranger( alwayson 1 pose [0 0 0." + std::to_string(i + 10) + " 0] sensor( ) )\n";
  const SceneSummary s = Summarize(*LoadText(text));
  EXPECT_EQ(s.heights.size(), 12u);
  EXPECT_EQ(s.layer_heights, 8u);
  EXPECT_EQ(s.layers, 10u);  // everything, eight heights, any height
}

TEST(Summary, TheLayersAreThoseThatAStepMakes) {
  const auto world = LoadText(kScene);
  const SceneSummary before = Summarize(*world);
  Step(*world);
  const SceneSummary after = Summarize(*world);
  EXPECT_EQ(after.layers, before.layers);
  EXPECT_EQ(after.memory.layers, 0u);
  // Change lists count too, but are not in the grid's own statistics.
  EXPECT_NEAR(static_cast<double>(after.memory.grid - before.memory.grid),
              static_cast<double>(before.memory.layers),
              0.05 * static_cast<double>(before.memory.layers));
  EXPECT_EQ(after.memory.readings, 0u);
}

TEST(Summary, GridOfOneSquare) {
  // Its outline: 10 cells a side, from (15, -5) to (25, 5).
  const SceneSummary s =
      Summarize(*LoadText("resolution 0.1 model( size [1 1 1] pose [2 0 0 0] )"));
  EXPECT_DOUBLE_EQ(s.resolution, 0.1);
  EXPECT_EQ(s.occupied_cells, 40u);
  EXPECT_EQ(s.tiles, 6u);
  EXPECT_EQ(s.regions, 2u);
  EXPECT_EQ(s.superregions, 2u);
  EXPECT_NEAR(s.extent.x.min, 0, 1e-12);
  EXPECT_NEAR(s.extent.x.max, 6.4, 1e-12);
  EXPECT_NEAR(s.extent.y.min, -6.4, 1e-12);
  EXPECT_NEAR(s.extent.y.max, 6.4, 1e-12);
  EXPECT_EQ(s.plane_cells, 64u * 128u);
  EXPECT_EQ(s.layers, 1u);
  EXPECT_EQ(s.dense_bytes, 64u * 128u * 4u + 64u * 128u / 8u);
}

TEST(Summary, Memory) {
  const SceneSummary s = Summarize(*LoadText(kScene));
  EXPECT_EQ(s.memory.readings, 100u * 3u * sizeof(double));
  EXPECT_EQ(s.memory.pictures, 20u * 10u * 8u);
  EXPECT_GT(s.memory.layers, 0u);
  EXPECT_GT(s.memory.batch, 0u);
  EXPECT_GT(s.memory.models, 8u * sizeof(Model));
  EXPECT_GT(s.memory.bodies, 24u * sizeof(point_t));
}

TEST(Summary, AnEmptyWorld) {
  const SceneSummary s = Summarize(*LoadText(""));
  EXPECT_EQ(s.models, 0u);
  EXPECT_TRUE(s.sensors.empty());
  EXPECT_TRUE(s.heights.empty());
  EXPECT_EQ(s.plane_cells, 0u);
  EXPECT_EQ(s.layers, 1u);
  EXPECT_EQ(s.power_packs, 0u);
  EXPECT_FALSE(s.records_trails);
  EXPECT_FALSE(s.has_window);
  EXPECT_EQ(s.device, "");
}

TEST(Summary, EnergyAndCallbacks) {
  const auto world = LoadText(
      "interval_sim 100 position( name \"r\" joules 10 alwayson 1 update_interval 200 )\n"
      "model( )");
  world->AddUpdateCallback([](World*, void*) { return 0; }, nullptr);
  Find(*world, "r")
      ->AddCallback(
          Model::CB_UPDATE, [](Model*, void*) { return 0; }, nullptr);
  const SceneSummary s = Summarize(*world);
  EXPECT_EQ(s.power_packs, 1u);
  EXPECT_EQ(s.energy_models, 1u);
  EXPECT_DOUBLE_EQ(s.callbacks_per_step, 1.5);
}

constexpr char kFields[] =
    "interval_sim 100 field( name \"f\" size [4 2 0] field_resolution 0.1 diffusion 0.01 "
    "update_interval 200 ) field( size [9 9 0] field_resolution 0.1 )";

TEST(Summary, FieldsThatChange) {
  const SceneSummary s = Summarize(*LoadText(kFields));
  EXPECT_EQ(s.fields, 1u) << "the other one stays as it is";
  EXPECT_DOUBLE_EQ(s.field_cells, 40 * 20 / 2);
}

// ---- measuring ----------------------------------------------------------------------------------

TEST(StepCosts, AreMeasuredForRunningModels) {
  const auto world = LoadText(kScene);
  const SceneSummary s = Summarize(*world);
  const StepCosts costs = MeasureStepCosts(*world, 0.02);
  ASSERT_EQ(costs.sensors.size(), s.sensors.size());
  EXPECT_EQ(costs.sensors[0].sample, 1u);  // the eye
  EXPECT_EQ(costs.sensors[0].rays, 100);
  EXPECT_GT(costs.sensors[0].ray_ns, 0);
  EXPECT_GT(costs.sensors[0].update_ns, 0);
  EXPECT_GT(costs.sensors[0].read_ns, 0);
  EXPECT_LT(costs.sensors[0].device_ray_ns, 0);
  EXPECT_EQ(costs.sensors[1].sample, 1u);  // the lens
  EXPECT_EQ(costs.sensors[1].rays, 0);
  EXPECT_GT(costs.sensors[1].update_ns, 0);
  EXPECT_EQ(costs.sensors[2].sample, 0u);  // the spare
  EXPECT_EQ(costs.position_sample, 1u);
  EXPECT_EQ(costs.move_sample, 1u);
  EXPECT_GT(costs.move_ns, 0);
  EXPECT_EQ(costs.energy_sample, 0u);
  EXPECT_GE(costs.rays, 100u);
  EXPECT_GT(costs.seconds, 0);
}

TEST(StepCosts, FieldsAreMeasuredAndStayAsTheyAre) {
  const auto world = LoadText(kFields);
  dynamic_cast<ModelField*>(Find(*world, "f"))->SetValue(0, 0, 1);
  const uint64_t before = world->StateHash();
  const StepCosts costs = MeasureStepCosts(*world, 0.02);
  EXPECT_EQ(costs.field_sample, 800u);
  EXPECT_GT(costs.field_cell_ns, 0);
  EXPECT_LT(costs.field_cell_ns, 1000);
  EXPECT_EQ(world->StateHash(), before);
}

TEST(StepCosts, OfAnEmptyWorld) {
  const StepCosts costs = MeasureStepCosts(*LoadText("model( )"), 0.02);
  EXPECT_TRUE(costs.sensors.empty());
  EXPECT_EQ(costs.move_sample, 0u);
  EXPECT_EQ(costs.field_sample, 0u);
  EXPECT_EQ(costs.rays, 0u);
}

TEST(StepCosts, RobotsThatTouchOthersAreNotMoved) {
  const auto world = LoadText(
      "position( alwayson 1 size [1 1 1] pose [0 0 0 0] )\n"
      "position( alwayson 1 size [1 1 1] pose [0.5 0 0 0] )\n");
  EXPECT_EQ(MeasureStepCosts(*world, 0.02).move_sample, 0u);
}

TEST(StepCosts, NoCallbackIsCalled) {
  const auto world = LoadText(kScene);
  int calls = 0;
  const auto count = [](Model*, void* user) {
    ++*static_cast<int*>(user);
    return 0;
  };
  for (const char* name : {"robot", "robot.eye", "lens"})
    for (const auto type : {Model::CB_UPDATE, Model::CB_VELOCITY, Model::CB_POSE})
      Find(*world, name)->AddCallback(type, count, &calls);
  MeasureStepCosts(*world, 0.02);
  EXPECT_EQ(calls, 0);
  Step(*world);
  EXPECT_GT(calls, 0);
}

TEST(StepCosts, MeasuringLeavesNoState) {
  const auto world = LoadText(kScene);
  auto* eye = Find<ModelRanger>(*world, "robot.eye");
  const Pose pose = Find(*world, "robot")->GetGlobalPose();
  const SceneSummary before = Summarize(*world);
  MeasureStepCosts(*world, 0.02);
  EXPECT_TRUE(eye->GetSensors()[0].ranges.empty());
  EXPECT_EQ(Find(*world, "robot")->GetGlobalPose(), pose);
  EXPECT_TRUE(Find<ModelPosition>(*world, "robot")->GetVelocity().IsZero());
  EXPECT_EQ(world->SimTimeNow(), 0u);
  EXPECT_EQ(world->UpdateCount(), 0u);
  EXPECT_EQ(world->statistics().trace.rays, 0u);
  const SceneSummary after = Summarize(*world);
  EXPECT_EQ(after.occupied_cells, before.occupied_cells);
  EXPECT_EQ(after.tiles, before.tiles);
}

/// The state hash after two runs of `steps` steps. With `measure` costs are measured before each.
uint64_t HashAfter(const std::string& file, bool measure, int steps) {
  const auto world = EmptyWorld();
  testing::internal::CaptureStdout();
  EXPECT_TRUE(world->Load(file));
  testing::internal::GetCapturedStdout();
  for (int i = 0; i < 2; i++) {
    if (measure) MeasureStepCosts(*world, 0.02);
    Step(*world, steps);
  }
  return world->StateHash();
}

TEST(StepCosts, RunsAreTheSameAfterwards) {
  const char* source = std::getenv("STAGE_SOURCE_DIR");
  const std::string worlds = std::string(source ? source : "..") + "/worlds/";
  for (const char* name : {"simple.world", "zoo.world", "foraging.world"})
    EXPECT_EQ(HashAfter(worlds + name, true, 50), HashAfter(worlds + name, false, 50)) << name;
}

TEST(StepCosts, NoiseIsTheSameAfterwards) {
  const auto hash = [](bool measure) {
    const auto world = LoadText(
        "ranger( alwayson 1 sensor( samples 20 noise [0.1 0.1 0.5] ) )\n"
        "model( pose [2 0 0 0] size [1 3 1] )\n"
        "wifi( alwayson 1 model \"log distance\" ) wifi( pose [3 0 0 0] alwayson 1 "
        "model \"log distance\" )\n");
    if (measure) MeasureStepCosts(*world, 0.02);
    Step(*world, 10);
    return world->StateHash();
  };
  EXPECT_EQ(hash(true), hash(false));
}

/// Arguments: update intervals (ms) of two models subscribed before and of one subscribed after.
void ExpectUpdatesInTime(int first, int second, int late) {
  const auto interval = [](int ms) { return "update_interval " + std::to_string(ms); };
  const auto world =
      LoadText("ranger( alwayson 1 " + interval(first) + " sensor( ) )\nranger( alwayson 1 " +
               interval(second) + " sensor( ) )\nranger( name \"late\" " + interval(late) +
               " sensor( ) )\n");
  MeasureStepCosts(*world, 0.02);
  Model* model = Find(*world, "late");
  model->Subscribe();
  std::vector<int> updates, expected;
  model->AddCallback(
      Model::CB_UPDATE,
      [](Model* mod, void* times) {
        static_cast<std::vector<int>*>(times)->push_back(
            static_cast<int>(mod->GetWorld()->SimTimeNow() / 1000));
        return 0;
      },
      &updates);
  Step(*world, 12);
  for (int ms = late; ms <= 1200; ms += late) expected.push_back(ms);
  EXPECT_EQ(updates, expected) << first << ", " << second << ", " << late;
}

TEST(StepCosts, LaterSubscribersUpdateOnTime) {
  for (const int first : {100, 200, 300})
    for (const int second : {100, 200, 300})
      for (const int late : {100, 200, 300}) ExpectUpdatesInTime(first, second, late);
}

TEST(StepCosts, WithThreads) {
  InitLibrary();
  World::run_options.threads = 2;
  {
    const auto world = LoadText(kScene);
    EXPECT_EQ(Summarize(*world).threads, 2u);
    EXPECT_GT(MeasureStepCosts(*world, 0.02).sensors[0].ray_ns, 0);
  }
  World::run_options.threads = 0;
}

}  // namespace
}  // namespace Stg
