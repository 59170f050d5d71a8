// SPDX-License-Identifier: GPL-2.0-or-later
//
// Errors of rangers other than noise: lost returns, blindness to what is near, and rounding.

#include <cmath>
#include <string>
#include <vector>

#include "ranger_testing.hh"

namespace Stg {
namespace {

constexpr char kWall[] = "resolution 0.01\nmodel( pose [2.05 0 0 0] size [0.1 40 1] )";

/// The readings of a sensor with these properties, without and with defects.
struct Pair {
  Pair(const std::string& properties, const std::string& defects, const std::string& rest)
      : without("sensor( ray_model \"exact\" " + properties + " )", rest),
        with("sensor( ray_model \"exact\" " + properties + " " + defects + " )", rest) {
    without.Ranges();
    with.Ranges();
  }
  size_t size() { return without.sensor().ranges.size(); }
  bool IsLost(size_t i) {
    return with.sensor().ranges[i] == with.sensor().range.max &&
           without.sensor().ranges[i] < without.sensor().range.max;
  }

  Scene without, with;
};

TEST(RangerDefects, RangesAreRoundedToSteps) {
  Pair pair("range [0 8] fov 140 samples 141", "range_step 0.05", kWall);
  for (size_t i = 0; i < pair.size(); i++) {
    const double exact = pair.without.sensor().ranges[i], r = pair.with.sensor().ranges[i];
    EXPECT_LE(std::fabs(r - exact), 0.025 + 1e-9) << i;
    EXPECT_NEAR(r / 0.05, std::round(r / 0.05), 1e-9) << i;
  }
}

TEST(RangerDefects, RoundedRangesAreAtMostTheGreatest) {
  Pair pair("range [0 2.03]", "range_step 0.5", kWall);
  EXPECT_EQ(pair.with.sensor().ranges[0], 2.0);
  Pair beyond("range [0 2.03]", "range_step 1.4", kWall);
  EXPECT_EQ(beyond.with.sensor().ranges[0], 1.4);
  Pair limited("range [0 2.03]", "range_step 1.3", kWall);
  EXPECT_EQ(limited.with.sensor().ranges[0], 2.03) << "2.6 is beyond the range";
}

TEST(RangerDefects, NothingIsSeenNearIfTheSensorIsBlindThere) {
  Pair pair("range [2.5 8] fov 140 samples 141", "blind_near 1", kWall);
  for (size_t i = 0; i < pair.size(); i++) {
    EXPECT_EQ(pair.IsLost(i), pair.without.sensor().ranges[i] < 2.5) << i;
    EXPECT_EQ(pair.with.sensor().intensities[i] == 0, pair.with.sensor().ranges[i] == 8) << i;
    if (!pair.IsLost(i)) {
      EXPECT_EQ(pair.with.sensor().ranges[i], pair.without.sensor().ranges[i]);
    }
  }
  EXPECT_TRUE(pair.IsLost(70));
  EXPECT_FALSE(pair.IsLost(10));
}

TEST(RangerDefects, ReturnsAreLostWithTheirProbability) {
  constexpr int kSamples = 50000;
  for (const double loss : {0.0, 0.1, 0.5, 1.0}) {
    Pair pair("range [0 8] fov 0 samples " + std::to_string(kSamples),
              "loss " + std::to_string(loss), kWall);
    int lost = 0;
    for (size_t i = 0; i < pair.size(); i++) {
      lost += pair.IsLost(i);
      ASSERT_EQ(pair.with.sensor().intensities[i] == 0, pair.IsLost(i));
    }
    EXPECT_NEAR(lost, loss * kSamples, 4 * std::sqrt(kSamples * loss * (1 - loss)) + 1e-6);
  }
}

TEST(RangerDefects, TheRaysThatAreLostDifferBetweenSteps) {
  Scene scene("sensor( range [0 8] fov 0 samples 1000 loss 0.5 )", kWall);
  const std::vector<double> first = scene.Ranges();
  EXPECT_NE(first, scene.Ranges());
}

// A ray at the bearing b meets a wall across the middle ray with the incidence |b|, and one along a
// line that is turned by t with |b - t|.
TEST(RangerDefects, SteepRaysAreLost) {
  for (const double turn : {0.0, 20.0, -35.0})
    for (const double steepest : {30.0, 60.0, 75.0}) {
      Pair pair(
          "range [0 200] fov 170 samples 341", "steepest " + std::to_string(steepest),
          "resolution 0.02\nmodel( pose [3 0 0 " + std::to_string(turn) + "] size [0.1 300 1] )");
      for (size_t i = 0; i < pair.size(); i++) {
        const double incidence = std::fabs(rtod(pair.without.sensor().bearings[i]) - turn);
        if (std::fabs(incidence - steepest) < 0.5) continue;  // the chord is between two rays
        if (!(pair.without.sensor().ranges[i] < 200)) continue;
        EXPECT_EQ(pair.IsLost(i), incidence > steepest) << incidence << " " << steepest;
      }
    }
}

TEST(RangerDefects, EdgesOfSurfacesAreSeen) {
  Pair pair("range [0 8] fov 60 samples 121", "steepest 80",
            "resolution 0.01\nmodel( pose [1.05 0 0 0] size [0.1 0.4 1] )\n"
            "model( pose [4.05 0 0 0] size [0.1 40 1] )");
  for (size_t i = 0; i < pair.size(); i++) EXPECT_FALSE(pair.IsLost(i)) << i;
}

TEST(RangerDefects, OneRayHasNoIncidence) {
  Pair pair("pose [0 0 0 80] range [0 20]", "steepest 10", kWall);
  EXPECT_FALSE(pair.IsLost(0));
}

TEST(RangerDefects, LossesAndNoiseAreIndependent) {
  Scene scene(
      "sensor( ray_model \"exact\" range [0 8] fov 0 samples 20000 noise [0.01 0 0] loss 0.3 )",
      kWall);
  std::vector<double> seen;
  for (const double r : scene.Ranges())
    if (r < 8) seen.push_back(r);
  EXPECT_NEAR(static_cast<double>(seen.size()), 14000, 300);
  const Moments m = MomentsOf(seen);
  EXPECT_NEAR(m.mean, 2, 0.005);
  EXPECT_NEAR(m.deviation, 0.1, 0.003);
}

TEST(RangerDefects, HashesWithoutDefectsAreThoseOfPlainSensors) {
  Pair pair("range [0 8] samples 10", "loss 0 range_step 0 blind_near 0 steepest 90", kWall);
  EXPECT_EQ(pair.without.world->StateHash(), pair.with.world->StateHash());
  Pair other("range [0 8] samples 10", "loss 0.1", kWall);
  EXPECT_NE(other.without.world->StateHash(), other.with.world->StateHash());
}

TEST(RangerDefects, NumbersThatMakeNoSenseAreRefused) {
  for (const char* wrong :
       {"loss 1.1", "loss -0.1", "steepest 91", "steepest -1", "range_step -1"}) {
    const auto world = EmptyWorld();
    const LoadOutcome outcome =
        TryToLoad(world.get(), std::string("ranger( sensor( ") + wrong + " ) )\n");
    EXPECT_FALSE(outcome.loaded) << wrong;
    EXPECT_NE(outcome.errors.find("t.world:1:"), std::string::npos) << outcome.errors;
    EXPECT_NE(outcome.errors.find("expected"), std::string::npos) << outcome.errors;
  }
}

}  // namespace
}  // namespace Stg
