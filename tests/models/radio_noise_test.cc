// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random losses and errors of what a radio receives, and messages as state.

#include <cmath>
#include <string>
#include <vector>

#include "radio_testing.hh"
#include "world/snapshot.hh"

namespace Stg {
namespace {

// ---- errors of measurements ---------------------------------------------------------------------

struct Moments {
  double mean, deviation;
};

Moments MomentsOf(const std::vector<double>& numbers) {
  double sum = 0, squares = 0;
  for (const double number : numbers) sum += number;
  const double count = static_cast<double>(numbers.size()), mean = sum / count;
  for (const double number : numbers) squares += (number - mean) * (number - mean);
  return {mean, std::sqrt(squares / count)};
}

TEST(Radio, ErrorsAreNormalWithTheGivenDeviations) {
  Pair pair("", "range_noise 0.2 bearing_noise 3");
  std::vector<double> ranges, bearings;
  int beyond = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; i++) {
    ASSERT_EQ(pair.Pass(), "hi");
    ranges.push_back(pair.b->Received()[0].range - 5);
    bearings.push_back(pair.b->Received()[0].bearing - std::atan2(-4, -3));
    beyond += std::fabs(ranges.back()) > 0.4;
  }
  const double deviation = 3 * M_PI / 180;
  // Five standard deviations of the moments.
  EXPECT_NEAR(MomentsOf(ranges).mean, 0, 5 * 0.2 / std::sqrt(kCount));
  EXPECT_NEAR(MomentsOf(ranges).deviation, 0.2, 5 * 0.2 / std::sqrt(2 * kCount));
  EXPECT_NEAR(MomentsOf(bearings).mean, 0, 5 * deviation / std::sqrt(kCount));
  EXPECT_NEAR(MomentsOf(bearings).deviation, deviation, 5 * deviation / std::sqrt(2 * kCount));
  EXPECT_NEAR(beyond / static_cast<double>(kCount), 0.0455, 0.006) << "beyond two deviations";
  double product = 0;
  for (size_t i = 0; i < ranges.size(); i++) product += ranges[i] * bearings[i];
  EXPECT_NEAR(product / kCount / (0.2 * deviation), 0, 5 / std::sqrt(kCount)) << "uncorrelated";
}

TEST(Radio, RangesAreNotNegativeAndBearingsAreNormalized) {
  Pair pair("", "range_noise 50 bearing_noise 1000");
  for (int i = 0; i < 300; i++) {
    ASSERT_EQ(pair.Pass(), "hi");
    EXPECT_GE(pair.b->Received()[0].range, 0);
    EXPECT_LE(std::fabs(pair.b->Received()[0].bearing), M_PI);
  }
}

TEST(Radio, LossesHaveTheGivenProbability) {
  for (const double loss : {0.1, 0.5, 0.9}) {
    Pair pair("", "loss " + std::to_string(loss));
    constexpr int kCount = 20000;
    int lost = 0;
    for (int i = 0; i < kCount; i++) lost += pair.Pass().empty();
    // Five standard deviations of the binomial distribution.
    EXPECT_NEAR(lost, kCount * loss, 5 * std::sqrt(kCount * loss * (1 - loss))) << loss;
  }
  Pair never("", "loss 0"), always("", "loss 1");
  for (int i = 0; i < 100; i++) {
    EXPECT_EQ(never.Pass(), "hi");
    EXPECT_EQ(always.Pass(), "");
  }
}

/// Each receiver has its own random numbers, which depend on the seed.
TEST(Radio, ReceiversLoseMessagesIndependently) {
  Pair pair("", "loss 0.5", Radio("c", 3, 4, "loss 0.5 alwayson 1"));
  auto* c = Find<ModelRadio>(*pair.world, "c");
  int both = 0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; i++) both += !pair.Pass().empty() && !Heard(*c).empty();
  EXPECT_NEAR(both, kCount / 4.0, 5 * std::sqrt(kCount * 3.0 / 16));
}

// ---- state --------------------------------------------------------------------------------------

TEST(Radio, MessagesAreState) {
  Pair pair("delay 1", "range_noise 0.1");
  const uint64_t silent = pair.world->StateHash();
  Snapshot before;
  ASSERT_TRUE(pair.world->Take(&before));
  SendText(pair.a, "hi");
  EXPECT_NE(pair.world->StateHash(), silent);
  const uint64_t sending = pair.world->StateHash();
  Snapshot under_way;
  ASSERT_TRUE(pair.world->Take(&under_way));
  Step(*pair.world, 2);
  ASSERT_EQ(Heard(*pair.b), "hi");
  const double range = pair.b->Received()[0].range;
  const uint64_t received = pair.world->StateHash();
  ASSERT_TRUE(pair.world->Restore(before));
  EXPECT_EQ(pair.world->StateHash(), silent);
  EXPECT_EQ(Heard(*pair.b), "");
  ASSERT_TRUE(pair.world->Restore(under_way));
  EXPECT_EQ(pair.world->StateHash(), sending);
  Step(*pair.world, 2);
  EXPECT_EQ(pair.world->StateHash(), received);
  EXPECT_EQ(pair.b->Received()[0].range, range);
}

TEST(Radio, AnotherTextIsAnotherState) {
  Pair pair, other;
  SendText(pair.a, "hi");
  SendText(other.a, "ho");
  EXPECT_NE(pair.world->StateHash(), other.world->StateHash());
}

}  // namespace
}  // namespace Stg
