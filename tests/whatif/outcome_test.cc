// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/outcome.hh"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>

#include "random/random.hh"
#include "whatif/consequence_engine.hh"

namespace Stg {
namespace {

Outcome OutcomeWith(std::initializer_list<double> scores) {
  Outcome outcome;
  for (const double each : scores) {
    outcome.scores.push_back(each);
    outcome.score += each / static_cast<double>(scores.size());
  }
  return outcome;
}

Outcome OutcomeWithCollisions(size_t collisions, size_t samples) {
  Outcome outcome;
  for (size_t i = 0; i < samples; i++) outcome.collided.push_back(i < collisions);
  return outcome;
}

TEST(OutcomeTest, QuantilesInterpolateBetweenSortedScores) {
  const Outcome outcome = OutcomeWith({3, 1, 2, 5, 4});
  EXPECT_EQ(outcome.Worst(), 1);
  EXPECT_EQ(outcome.Quantile(0), 1);
  EXPECT_EQ(outcome.Quantile(0.5), 3);
  EXPECT_EQ(outcome.Quantile(0.125), 1.5);
  EXPECT_EQ(outcome.Quantile(1), 5);
  EXPECT_TRUE(std::isnan(outcome.Quantile(1.1)));
  EXPECT_TRUE(std::isnan(Outcome().Quantile(0.5)));
  EXPECT_DOUBLE_EQ(outcome.Deviation(), std::sqrt(2.5));
}

/// The figures are those of Wilson's formula for 95 % as published in tables.
TEST(OutcomeTest, IntervalsOfCollisionsAreThoseOfWilson) {
  const Interval none = OutcomeWithCollisions(0, 10).CollisionInterval();
  EXPECT_EQ(none.low, 0);
  EXPECT_NEAR(none.high, 0.2775, 1e-4);
  const Interval half = OutcomeWithCollisions(5, 10).CollisionInterval();
  EXPECT_NEAR(half.low, 0.2366, 1e-4);
  EXPECT_NEAR(half.high, 0.7634, 1e-4);
  EXPECT_EQ(Outcome().CollisionInterval().high, 1);
}

/// With 95 %, the interval of 40 draws contains their true probability in most experiments.
TEST(OutcomeTest, IntervalsOfCollisionsContainTheTruth) {
  RandomStream random(3);
  for (const double truth : {0.02, 0.1, 0.5, 0.9}) {
    int contained = 0;
    for (int experiment = 0; experiment < 2000; experiment++) {
      Outcome outcome;
      for (int i = 0; i < 40; i++) outcome.collided.push_back(random.Uniform() < truth);
      const Interval found = outcome.CollisionInterval();
      contained += found.low <= truth && truth <= found.high;
    }
    EXPECT_GT(contained, 0.9 * 2000) << truth;
    EXPECT_LT(contained, 0.99 * 2000) << truth;
  }
}

TEST(OutcomeTest, MeansAreToldApartBySamplesWithTheSameNumbers) {
  const Outcome one = OutcomeWith({10, 20, 30, 40}), other = OutcomeWith({9, 19.1, 28.9, 39});
  const Outcome shuffled = OutcomeWith({39, 28.9, 19.1, 9});
  const Preference mean;
  EXPECT_TRUE(whatif::IsToldApart(one, other, mean, 2, 0)) << "each sample is better by about 1";
  EXPECT_FALSE(whatif::IsToldApart(one, other, mean, 2, 1.5));
  EXPECT_FALSE(whatif::IsToldApart(one, shuffled, mean, 2, 0));
  EXPECT_FALSE(whatif::IsToldApart(one, one, mean, 2, 1e-300));
  EXPECT_TRUE(whatif::IsToldApart(one, one, mean, 2, 0)) << "neither can be better";
  EXPECT_FALSE(whatif::IsToldApart(OutcomeWith({2}), OutcomeWith({1}), mean, 2, 0));
}

/// Student's correction keeps the rate of errors of a test with few samples near that of 2 standard
/// errors of a normal distribution, 2.3 % on each side.
TEST(OutcomeTest, EqualCandidatesAreSeldomToldApart) {
  RandomStream random(5);
  const auto draw = [&] {
    double sum = -6;
    for (int k = 0; k < 12; k++) sum += random.Uniform();
    return sum;
  };
  for (const size_t samples : {4u, 10u, 40u}) {
    int wrong = 0;
    for (int experiment = 0; experiment < 4000; experiment++) {
      Outcome one, other;
      for (size_t i = 0; i < samples; i++) {
        one.scores.push_back(draw());
        other.scores.push_back(draw());
      }
      wrong += whatif::IsToldApart(one, other, Preference(), 2, 1e-300);
    }
    EXPECT_GT(wrong, 0.012 * 4000) << samples;
    EXPECT_LT(wrong, 0.035 * 4000) << samples;
  }
}

TEST(OutcomeTest, QuantilesAreToldApartByOrderStatistics) {
  const Preference low(Preference::kQuantile, 0.25);
  Outcome one, other;
  for (int i = 0; i < 40; i++) {
    one.scores.push_back(i);
    other.scores.push_back(i - 14);
  }
  EXPECT_TRUE(whatif::IsToldApart(one, other, low, 2, 0));
  EXPECT_FALSE(whatif::IsToldApart(one, other, low, 2, 3));
  EXPECT_FALSE(whatif::IsToldApart(OutcomeWith({9, 9}), OutcomeWith({1, 1}), low, 2, 0))
      << "two samples say nothing about a quarter";
  EXPECT_FALSE(whatif::IsToldApart(one, other, Preference(Preference::kWorst), 2, 0));
}

TEST(OutcomeTest, PreferencesCompareWhatTheyName) {
  const Outcome outcome = OutcomeWith({1, 2, 6});
  EXPECT_EQ(Preference().ValueOf(outcome), 3);
  EXPECT_EQ(Preference(Preference::kWorst).ValueOf(outcome), 1);
  EXPECT_EQ(Preference(Preference::kQuantile, 0.5).ValueOf(outcome), 2);
}

}  // namespace
}  // namespace Stg
