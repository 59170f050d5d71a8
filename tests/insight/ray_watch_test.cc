// SPDX-License-Identifier: GPL-2.0-or-later
//
// The record of a watched ray explains the actual reading; watching does not change the run.

#include "insight/ray_watch.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

using sensing::RayRecord;
using Answer = RayRecord::Answer;

std::vector<ModelRanger*> RangersOf(const World& world) {
  std::vector<ModelRanger*> rangers;
  for (Model* model : world.GetAllModels())
    if (auto* ranger = dynamic_cast<ModelRanger*>(model)) rangers.push_back(ranger);
  std::ranges::sort(rangers, {}, [](const Model* model) { return model->GetId(); });
  return rangers;
}

bool HasNoise(const ModelRanger::Sensor& sensor) {
  return sensor.range_noise != 0 || sensor.range_noise_const != 0;
}

size_t CountAnswers(const RayRecord& record, Answer answer) {
  size_t count = 0;
  for (const RayRecord::PotentialHit& cell : record.potential_hits)
    count +=
        static_cast<size_t>(std::ranges::count(cell.tests, answer, &RayRecord::BodyTest::answer));
  return count;
}

/// Checks that a record is consistent.
void ExpectConsistent(const RayExplanation& ray, const std::string& where) {
  const RayRecord& record = ray.record;
  const size_t accepted = CountAnswers(record, Answer::kAccepted);
  EXPECT_EQ(accepted > 0, !ray.hit.empty()) << where;
  if (!record.fan.exact) {
    EXPECT_LE(accepted, 1u) << where;
    if (accepted == 1) {  // the last body tested; the range ends at that cell
      EXPECT_EQ(record.potential_hits.back().tests.back().answer, Answer::kAccepted) << where;
      EXPECT_EQ(record.potential_hits.back().middle, record.hit.range) << where;
    }
  }
  if (ray.hit.empty()) {
    EXPECT_EQ(record.hit.range, record.fan.range) << where;
  }
  EXPECT_EQ(record.legs.empty(), record.fan.nothing) << where;
}

struct Way {
  RayModel model;
  bool batch;
  int threads;
};

RunOptions OptionsOf(const Way& way) {
  RunOptions options;
  options.seed = 7;
  options.listed = false;
  options.ray_model = way.model;
  options.batch = way.batch;
  options.threads = way.threads;
  options.share_from = 1;
  return options;
}

struct Ray {
  const ModelRanger* ranger = nullptr;  // null: no ray
  uint32_t sensor = 0, sample = 0;
};

Ray PickRay(const World& world, test::RandomSource* random) {
  std::vector<Ray> choices;  // the first sample of each sensor
  for (const ModelRanger* ranger : RangersOf(world))
    for (uint32_t i = 0; i < ranger->GetSensors().size(); i++)
      if (ranger->GetSensors()[i].sample_count > 0) choices.push_back({ranger, i, 0});
  if (choices.empty()) return {};
  Ray ray = random->Pick(choices);
  const unsigned samples = ray.ranger->GetSensors()[ray.sensor].sample_count;
  ray.sample = static_cast<uint32_t>(random->Next() % samples);
  return ray;
}

void ExpectReading(const World& world, const Ray& ray, const RayExplanation& explained) {
  const std::string where = ray.ranger->TokenStr() + ":" + std::to_string(ray.sensor) + ":" +
                            std::to_string(ray.sample) + " " + world.ClockString();
  EXPECT_EQ(explained.time, world.SimTimeNow()) << where;
  ExpectConsistent(explained, where);
  const ModelRanger::Sensor& read = ray.ranger->GetSensors()[ray.sensor];
  if (HasNoise(read)) return;
  EXPECT_EQ(explained.record.hit.range, read.ranges[ray.sample]) << where;
}

/// Runs `steps` steps, watching another random ray in each. Returns the number of rays recorded.
int WatchRandomRays(World* world, uint64_t seed, int steps) {
  test::RandomSource random(seed);
  int seen = 0;
  for (int step = 0; step < steps; step++) {
    const Ray ray = PickRay(*world, &random);
    if (!ray.ranger) {
      world->Update();
      continue;
    }
    const RayWatch watch(world, *ray.ranger, ray.sensor, ray.sample);
    world->Update();
    if (!watch.last()) continue;
    seen++;
    ExpectReading(*world, ray, *watch.last());
  }
  return seen;
}

TEST(RayWatch, ExplainsTheReadingInEachWorld) {
  InitLibrary();
  constexpr int kSteps = kSanitized ? 5 : 30;
  int seen = 0;
  for (const std::string& file : ShippedWorlds()) {
    if (file.ends_with("lasernoise.world")) continue;  // its controller changes the readings
    for (const Way& way : {Way{RayModel::kCell, true, 1}, Way{RayModel::kExact, true, 2},
                           Way{RayModel::kCell, false, 1}}) {
      World watched(OptionsOf(way)), left_alone(OptionsOf(way));
      ASSERT_TRUE(watched.Load(file)) << file;
      ASSERT_TRUE(left_alone.Load(file)) << file;
      seen += WatchRandomRays(&watched, 1, kSteps);
      for (int i = 0; i < kSteps; i++) left_alone.Update();
      EXPECT_EQ(watched.SimTimeNow(), left_alone.SimTimeNow()) << file;
      EXPECT_EQ(watched.StateHash(), left_alone.StateHash()) << file;
    }
  }
  EXPECT_GT(seen, 10 * kSteps);
}

/// From near to far: a model that is too low, one that rangers look through, a wall.
constexpr char kWall[] = R"(
  resolution 0.02
  interval_sim 100
  model( name "low" pose [1 0 0 0] size [0.2 1 0.1] )
  model( name "glass" pose [2 0 0 0] size [0.2 1 1] ranger_return -1 )
  model( name "wall" pose [3 0 0 0] size [0.2 1 1] )
  model( name "r" pose [0 0 0 0] size [0.2 0.2 0.5]
    ranger( name "eye" alwayson 1 sensor( pose [0 0 0.3 0] range [0 8] fov 0 samples 1 ) ) )
)";

TEST(RayWatch, NamesTheBodiesTested) {
  for (const RayModel model : {RayModel::kCell, RayModel::kExact}) {
    const std::unique_ptr<World> loaded = LoadText(kWall);
    World& world = *loaded;
    world.SetRayModel(model);
    const ModelRanger& ranger = *RangersOf(world)[0];
    const RayWatch watch(&world, ranger, 0, 0);
    world.Update();
    world.Update();
    ASSERT_NE(watch.last(), nullptr);
    const RayExplanation& ray = *watch.last();
    EXPECT_EQ(ray.hit, "wall");
    EXPECT_EQ(ray.record.fan.exact, model == RayModel::kExact);
    EXPECT_GT(ray.record.hidden_cells, 0u) << "its own body";
    EXPECT_NEAR(ray.record.hit.range, 2.9, 0.03);
    EXPECT_EQ(ray.models.size(), ray.record.potential_hits.size());
    for (const std::vector<std::string>& names : ray.models)
      for (const std::string& name : names) EXPECT_EQ(name, "wall") << "others are in other layers";
  }
}

TEST(RayWatch, IsSilentForSensorsThatDoNotUpdate) {
  const std::unique_ptr<World> world = LoadText(kWall);
  const ModelRanger& ranger = *RangersOf(*world)[0];
  const_cast<ModelRanger&>(ranger).Unsubscribe();
  const RayWatch watch(world.get(), ranger, 0, 0);
  for (int i = 0; i < 5; i++) world->Update();
  EXPECT_EQ(watch.last(), nullptr);
}

}  // namespace
}  // namespace Stg
