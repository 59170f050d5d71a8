// SPDX-License-Identifier: GPL-2.0-or-later
//
// Response curves of rangers' sensors: values, noise, state, and bad tables.

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"

namespace Stg {
namespace {

using Sensor = ModelRanger::Sensor;

const std::string kCurve = "response [0.5 100 1 40 2 10] ";

/// A world with a subscribed ranger "r" whose sensor looks at a wall `distance` metres ahead.
struct Scene {
  explicit Scene(double distance, const std::string& properties = kCurve)
      : world(LoadText("ray_model \"exact\"\nranger( name \"r\" sensor( range [0 5] " + properties +
                       " ) )\nmodel( size [1 4 1] pose [" + std::to_string(distance + 0.5) +
                       " 0 0 0] )")),
        ranger(FindRunning<ModelRanger>(*world, "r")) {}
  const Sensor& Read() {
    Step(*world);
    return ranger->GetSensors()[0];
  }
  std::unique_ptr<World> world;
  ModelRanger* ranger;
};

TEST(RangerResponse, IsLinearBetweenItsPointsAndConstantBeyond) {
  for (const auto& [distance, value] :
       {std::pair(0.25, 100.0), std::pair(0.5, 100.0), std::pair(0.75, 70.0), std::pair(1.0, 40.0),
        std::pair(1.5, 25.0), std::pair(2.0, 10.0), std::pair(3.0, 10.0)}) {
    Scene scene(distance);
    const Sensor& sensor = scene.Read();
    EXPECT_NEAR(sensor.ranges.at(0), distance, 1e-6);
    EXPECT_NEAR(sensor.values.at(0), value, 1e-3) << distance;
  }
  EXPECT_EQ(Scene(20).Read().values.at(0), 10);  // nothing in range
}

TEST(RangerResponse, UsesTheUnitsOfTheFile) {
  const auto world =
      LoadText("unit_length \"cm\"\nranger( name \"r\" sensor( response [0 1 100 0] ) )");
  const auto& points = Find<ModelRanger>(*world, "r")->GetSensors()[0].response.points();
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[1].range, 1);
}

TEST(RangerResponse, BelongsToTheRangesWithTheirNoise) {
  Scene scene(1.2, kCurve + "samples 20 fov 60 noise [0.01 0.1 0]");
  for (int i = 0; i < 10; i++) {
    const Sensor& sensor = scene.Read();
    ASSERT_EQ(sensor.values.size(), 20u);
    for (size_t k = 0; k < 20; k++)
      EXPECT_EQ(sensor.values[k], sensor.response.At(sensor.ranges[k]));
  }
}

TEST(RangerResponse, HasTheMomentsOfItsNoise) {
  constexpr int kCount = 4000;
  Scene scene(1, kCurve + "response_noise [3 0.1]");
  double sum = 0, squares = 0;
  for (int i = 0; i < kCount; i++) {
    const double error = scene.Read().values.at(0) - 40;
    sum += error;
    squares += error * error;
  }
  const double limit = 5 * 5 / std::sqrt(kCount);  // the deviation is 5; five standard errors
  EXPECT_NEAR(sum / kCount, 0, limit);
  EXPECT_NEAR(std::sqrt(squares / kCount), 5, limit);
}

TEST(RangerResponse, IsNotNegativeUnlessTheTableIs) {
  Scene scene(1, "response [0 1 1 0] response_noise [5 0]"), other(1, "response [0 1 1 -1]");
  bool any_zero = false;
  for (int i = 0; i < 50; i++) {
    const double value = scene.Read().values.at(0);
    EXPECT_GE(value, 0);
    any_zero |= value == 0;
  }
  EXPECT_TRUE(any_zero);
  EXPECT_NEAR(other.Read().values.at(0), -1, 1e-6);
}

TEST(RangerResponse, IsPartOfTheState) {
  Scene scene(1, kCurve + "response_noise [3 0.1]");
  scene.Read();
  Snapshot snapshot;
  ASSERT_TRUE(scene.world->Take(&snapshot));
  const uint64_t before = scene.world->StateHash();
  scene.ranger->GetSensorsMutable()[0].values[0] += 1;
  EXPECT_NE(scene.world->StateHash(), before);
  const std::vector<double> next = scene.Read().values;
  ASSERT_TRUE(scene.world->Restore(snapshot));
  EXPECT_EQ(scene.world->StateHash(), before);
  EXPECT_EQ(scene.Read().values, next);
}

TEST(RangerResponse, KeepsWorldsFromBeingClosed) {
  const auto why = [](const std::string& properties) {
    const auto world = LoadText("ranger( alwayson 1 sensor( " + properties + " ) )");
    return Branches(*world, 1).WhyNotClosed();
  };
  EXPECT_NE(why(kCurve).find("has a response curve"), std::string::npos) << why(kCurve);
  EXPECT_EQ(why("").find("has a response curve"), std::string::npos) << why("");
}

TEST(RangerResponse, SensorsWithoutOneHaveNoValues) {
  EXPECT_TRUE(Scene(1, "").Read().values.empty());
}

TEST(RangerResponse, BadTablesAreRefused) {
  for (const char* bad : {"response [1 2]", "response [0 1 1]", "response [1 2 0 3]",
                          "response [0 1 0 2]", "response [-1 1 0 2]", "response 7",
                          "response_noise [-1 0]", "response_noise [0 -1]", "response_noise 1"}) {
    const LoadOutcome outcome = TryToLoad("ranger( sensor( " + std::string(bad) + " ) )");
    EXPECT_FALSE(outcome.loaded) << bad;
    EXPECT_EQ(outcome.errors.find("t.world:1:"), 0u) << bad << ": " << outcome.errors;
    EXPECT_EQ(outcome.errors.find('\n'), outcome.errors.size() - 1) << outcome.errors;
  }
}

}  // namespace
}  // namespace Stg
