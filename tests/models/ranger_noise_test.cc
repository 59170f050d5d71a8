// SPDX-License-Identifier: GPL-2.0-or-later
//
// The noise of rangers.

#include <cmath>

#include "ranger_testing.hh"

namespace Stg {
namespace {

// ---- noise --------------------------------------------------------------------------------------

TEST(Noise, TheConstantIsAVariance) {
  Scene scene("sensor( samples 20000 fov 0 noise [0.01 0 0] )");
  const double exact = Scene("sensor( )").Ranges().at(0);
  const Moments m = MomentsOf(scene.Ranges());
  EXPECT_NEAR(m.mean, exact, 0.003);
  EXPECT_NEAR(m.deviation, 0.1, 0.002);
  EXPECT_GT(m.max, exact + 0.3);
  EXPECT_LT(m.min, exact - 0.3);
}

TEST(Noise, TheProportionalPartIsUniform) {
  Scene scene("sensor( samples 20000 fov 0 noise [0 0.1 0] )");
  const double exact = Scene("sensor( )").Ranges().at(0);
  const Moments m = MomentsOf(scene.Ranges());
  EXPECT_NEAR(m.mean, exact, 0.004);
  EXPECT_NEAR(m.deviation, 0.1 * exact / std::sqrt(3.0), 0.002);
  EXPECT_GE(m.min, 0.9 * exact);
  EXPECT_LE(m.max, 1.1 * exact);
  EXPECT_LT(m.min, 0.901 * exact);
  EXPECT_GT(m.max, 1.099 * exact);
}

// The heading errors of rays, computed from their ranges to an oblique wall: at 60 degrees to the
// normal of a wall 2 m away, the range is 2 / cos(60 degrees + error).
std::vector<double> HeadingErrors(unsigned samples) {
  Scene scene("sensor( pose [0 0 0 60] range [0 30] noise [0 0 57.29577951308232] fov 20 samples " +
                  std::to_string(samples) + " )",
              "resolution 0.002\nmodel( pose [2.05 0 0 0] size [0.1 40 1] )");
  std::vector<double> errors;
  for (int i = 0; i < 400; i++) {
    Step(*scene.world);
    for (const double bearing : {scene.sensor().bearings[samples / 2]}) EXPECT_EQ(bearing, 0);
    errors.push_back(std::acos(2 / scene.sensor().ranges[samples / 2]) - M_PI / 3);
  }
  return errors;
}

TEST(Noise, TheAngularPartIsScaledByTheIncrement) {
  for (const unsigned samples : {3u, 5u}) {
    const double most = dtor(20.0 / (samples - 1)) / 2;
    const Moments m = MomentsOf(HeadingErrors(samples));
    EXPECT_NEAR(m.mean, 0, 0.1 * most);
    EXPECT_NEAR(m.deviation, most / std::sqrt(3.0), 0.1 * most);
    EXPECT_LT(m.max, most + 0.002);
    EXPECT_GT(m.max, 0.95 * most);
    EXPECT_GT(m.min, -most - 0.002);
    EXPECT_LT(m.min, -0.95 * most);
  }
}

TEST(Noise, TheAngularPartIsZeroForAFieldOfViewOfZero) {
  const std::string wall = "model( pose [2.05 0 0 0] size [0.1 40 1] )";
  Scene noisy("sensor( pose [0 0 0 60] samples 50 fov 0 noise [0 0 90] )", wall);
  Scene exact("sensor( pose [0 0 0 60] samples 50 fov 0 )", wall);
  EXPECT_EQ(noisy.Ranges(), exact.Ranges());
}

// Stage 4.3 does not clip noisy readings, which may be negative or beyond the maximum.
TEST(Noise, MakesNoReadingBelowTheMinimumOrAboveTheMaximum) {
  for (const char* range : {"[0 5]", "[0.3 2.6]", "[2.4 2.6]", "[2.5 100]"})
    for (const char* noise : {"[4 0 0]", "[0 5 0]", "[4 5 90]", "[0.0001 0 0]"}) {
      Scene hits("sensor( samples 5000 fov 0 range " + std::string(range) + " noise " + noise +
                 " )");
      const Bounds bounds = hits.sensor().range;
      const Moments m = MomentsOf(hits.Ranges());
      EXPECT_GE(m.min, bounds.min) << range << " " << noise;
      EXPECT_LE(m.max, bounds.max) << range << " " << noise;
      EXPECT_LT(m.min, m.max) << range << " " << noise;
    }
}

TEST(Noise, DoesNotChangeReadingsBelowTheMinimum) {
  Scene hits("sensor( samples 100 fov 0 range [4 8] noise [4 5 0] )");
  Scene exact("sensor( samples 100 fov 0 range [4 8] )");
  EXPECT_EQ(hits.Ranges(), exact.Ranges());
  EXPECT_LT(exact.Ranges()[0], 4);
}

TEST(Noise, LeavesMissesAlone) {
  Scene misses("sensor( samples 100 fov 0 noise [4 0.5 0] )", "");
  EXPECT_EQ(misses.Ranges(), std::vector<double>(100, 5));
}

TEST(Noise, InvalidMagnitudesCountAsZero) {
  Scene scene("sensor( samples 10 fov 0 )");
  const std::vector<double> exact = scene.Ranges();
  for (const double value : {-1.0, kNaN, 0.0}) {
    scene.sensor().range_noise_const = value;
    EXPECT_EQ(scene.Ranges(), exact);
  }
  scene.sensor().range_noise_const = 0;
  scene.sensor().range_noise = kNaN;
  scene.sensor().angle_noise = kNaN;
  EXPECT_EQ(scene.Ranges(), exact);
}

// The readings of two noisy sensors over some steps.
std::vector<double> NoisyReadings(int threads, uint64_t seed) {
  World::run_options.threads = threads;
  World::run_options.seed = seed;
  std::string text = kBoxAhead;
  for (int i = 0; i < 70; i++)
    text += "ranger( name \"l" + std::to_string(i) + "\" pose [0 " + std::to_string(i) +
            " 0 0] alwayson 1 sensor( samples 9 fov 180 noise [0.01 0.1 30] ) sensor( samples 2"
            " noise [0.01 0 0] ) )\nmodel( pose [2 " +
            std::to_string(i) + " 0 0] )\n";
  const auto world = LoadText(text);
  World::run_options = RunOptions();
  std::vector<double> readings;
  for (int step = 0; step < 4; step++) {
    Step(*world);
    for (int i = 0; i < 70; i++)
      for (const Sensor& s : Find<ModelRanger>(*world, "l" + std::to_string(i))->GetSensors())
        readings.insert(readings.end(), s.ranges.begin(), s.ranges.end());
  }
  return readings;
}

TEST(Noise, DependsOnTheSeedAlone) {
  const std::vector<double> first = NoisyReadings(1, 1);
  EXPECT_EQ(NoisyReadings(1, 1), first);
  EXPECT_EQ(NoisyReadings(4, 1), first);
  EXPECT_NE(NoisyReadings(1, 2), first);
  EXPECT_EQ(NoisyReadings(4, 2), NoisyReadings(1, 2));
}

TEST(Noise, DiffersBetweenSensors) {
  Scene scene(
      "sensor( noise [0.01 0 0] ) sensor( noise [0.01 0 0] )",
      std::string(kBoxAhead) + "ranger( name \"m\" alwayson 1 sensor( noise [0.01 0 0] ) )");
  Step(*scene.world);
  const double a = scene.sensor(0).ranges[0], b = scene.sensor(1).ranges[0],
               c = Find<ModelRanger>(*scene.world, "m")->GetSensors()[0].ranges[0];
  EXPECT_NE(a, b);
  EXPECT_NE(a, c);
  Step(*scene.world);
  EXPECT_NE(a, scene.sensor(0).ranges[0]);
}

}  // namespace
}  // namespace Stg
