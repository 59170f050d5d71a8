// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random worlds of lights and light sensors have equal states with any number of threads, after
// restoring a snapshot, and in branches; and sensors find the lights that a search of all finds.

#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "models/types/light_index.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

constexpr int kSteps = kSanitized ? 6 : 12;

/// Robots with lights and light sensors among walls.
std::string RandomLights(uint64_t seed, int robots) {
  test::RandomSource random(seed);
  std::ostringstream text;
  if (random.OneIn(2)) text << "ray_model \"exact\"\n";
  const double reach = std::sqrt(robots) * random.Real(0.4, 0.9);
  const auto pose = [&](double z) {
    text << " pose [" << random.Real(-reach, reach) << " " << random.Real(-reach, reach) << " " << z
         << " " << random.Int(-180, 180) << "]";
  };
  for (int i = 0; i < 10; i++) {
    text << "model( obstacle_return 0 size [0.4 0.1 " << random.Real(0.1, 0.6) << "]";
    pose(0);
    text << " )\n";
  }
  for (int i = 0; i < robots; i++) {
    text << "position( size [0.2 0.2 0.3] alwayson 1 velocity [" << random.Real(-0.5, 0.5)
         << " 0 0 " << random.Int(-90, 90) << "]";
    pose(0);
    const char* const kind = random.Pick<const char*>({"light", "lightindicator", "blinkenlight"});
    text << " " << kind << "( name \"l" << i
         << "\" pose [0.1 0 0 0] size [0.02 0.02 0.02] intensity " << random.Real(0, 2) << " )";
    text << " lightsensor( name \"s" << i << "\" alwayson 1 pose [0 0 " << -random.Real(0, 0.2)
         << " 0] range " << random.Real(0.5, 6) << " shadows " << random.Int(0, 1)
         << " directions [0 90 " << random.Int(-180, 180) << "] cosine_power " << random.Int(0, 3)
         << (random.OneIn(2) ? " noise [0.01 0.1]" : "") << " ) )\n";
  }
  return text.str();
}

std::unique_ptr<World> Load(const std::string& text, unsigned threads) {
  InitLibrary();
  RunOptions options;
  options.threads = threads;
  auto world = std::make_unique<World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "lights.world"));
  world->engine().ShareFrom(1);
  return world;
}

/// Switches some lights, depending on the step.
void Switch(World* world, int step) {
  int i = 0;
  for (LightSource* light : world->engine().lights->sources()) {
    if ((++i + step) % 3 != 0) continue;
    if (auto* lamp = dynamic_cast<ModelLight*>(light)) {
      lamp->SetOn(!lamp->IsOn());
      lamp->SetIntensity(0.1 * i);
    }
    if (auto* lamp = dynamic_cast<ModelLightIndicator*>(light)) lamp->SetState(!lamp->IsOn());
  }
}

std::vector<uint64_t> HashesOf(World* world, int first, int steps) {
  std::vector<uint64_t> hashes;
  for (int step = first; step < first + steps; step++) {
    Switch(world, step);
    world->Update();
    hashes.push_back(world->StateHash());
    EXPECT_EQ(world->Validate(), "");
  }
  return hashes;
}

TEST(Lights, AreEqualOnAnyNumberOfThreads) {
  for (uint64_t seed = 1; seed <= 6; seed++) {
    const std::string text = RandomLights(seed, 20);
    const auto alone = Load(text, 1);
    const std::vector<uint64_t> expected = HashesOf(alone.get(), 0, kSteps);
    double light = 0;
    for (const Model* model : alone->engine().models)
      if (const auto* sensor = dynamic_cast<const ModelLightSensor*>(model))
        for (const double reading : sensor->GetIntensities()) light += reading;
    EXPECT_GT(light, 0);
    for (const unsigned threads : {2u, 4u})
      EXPECT_EQ(HashesOf(Load(text, threads).get(), 0, kSteps), expected) << seed;
  }
}

TEST(Lights, ContinueAfterASnapshot) {
  for (uint64_t seed = 11; seed <= 14; seed++) {
    const std::string text = RandomLights(seed, 12);
    const auto world = Load(text, 1);
    HashesOf(world.get(), 0, 5);
    Snapshot snapshot;
    ASSERT_TRUE(world->Take(&snapshot));
    const std::vector<uint64_t> expected = HashesOf(world.get(), 5, kSteps);
    ASSERT_TRUE(world->Restore(snapshot));
    EXPECT_EQ(HashesOf(world.get(), 5, kSteps), expected) << seed;
    const auto other = Load(text, 2);
    HashesOf(other.get(), 3, 4);
    ASSERT_TRUE(other->Restore(snapshot));
    EXPECT_EQ(HashesOf(other.get(), 5, kSteps), expected) << seed;
  }
}

TEST(Lights, AreEqualInBranches) {
  const auto world = Load(RandomLights(21, 8), 1);
  HashesOf(world.get(), 0, 5);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  Branches branches(*world, 3);
  for (uint32_t i = 0; i < branches.count(); i++) branches.Restore(i, now);
  branches.Step(kSteps);
  for (int i = 0; i < kSteps; i++) world->Update();
  for (uint32_t i = 0; i < branches.count(); i++)
    EXPECT_TRUE(branches.Visit(i, [&](World& branch) {
      EXPECT_EQ(branch.StateHash(), world->StateHash()) << i;
    })) << i;
}

/// The reading of a sensor without shadows and noise: the sum over all lights of the world.
double SumOverAll(const ModelLightSensor& sensor, double axis) {
  const Pose eye = sensor.GetGlobalPose() + sensor.GetGeom().pose;
  double sum = 0;
  for (const LightSource* light : sensor.host().lights->sources()) {
    const Pose lamp = light->model().GetGlobalPose() + light->model().GetGeom().pose;
    const double dx = lamp.x - eye.x, dy = lamp.y - eye.y, distance = std::hypot(dx, dy);
    if (!light->IsOn() || light->model().IsRelated(&sensor) || distance > sensor.range) continue;
    const double cosine = std::cos(std::atan2(dy, dx) - eye.a - axis);
    const double counted = std::max(distance, sensor.least_distance);
    const double response =
        sensor.cosine_power == 0 ? 1 : std::pow(std::max(cosine, 0.0), sensor.cosine_power);
    sum += light->GetIntensity() / (counted * counted) * response;
  }
  return sum;
}

TEST(Lights, AreFoundAsByASearchOfAll) {
  test::RandomSource random(5);
  std::ostringstream text;
  for (int i = 0; i < 60; i++)
    text << "light( intensity " << random.Int(0, 3) << " on " << (random.OneIn(5) ? 0 : 1)
         << " pose [" << random.Real(-20, 20) << " " << random.Real(-20, 20) << " 0 0] )\n"
         << "lightsensor( alwayson 1 shadows 0 range " << random.Real(0, 15) << " pose ["
         << random.Real(-20, 20) << " " << random.Real(-20, 20) << " 0 " << random.Int(-180, 180)
         << "] cosine_power " << random.Int(0, 3) << " )\n";
  const auto world = LoadText(text.str());
  for (int step = 0; step < 10; step++) {
    Step(*world);
    int lit = 0;
    for (const Model* model : world->engine().models) {
      const auto* sensor = dynamic_cast<const ModelLightSensor*>(model);
      if (!sensor) continue;
      const double expected = SumOverAll(*sensor, 0);
      EXPECT_NEAR(sensor->GetIntensities()[0], expected, 1e-9 * (1 + expected));
      lit += expected > 0;
    }
    EXPECT_GT(lit, 20);
    for (Model* model : world->engine().models)
      if (model->GetModelType() == "light")
        model->SetPose(Pose(random.Real(-20, 20), random.Real(-20, 20), 0, 0));
  }
}

}  // namespace
}  // namespace Stg
