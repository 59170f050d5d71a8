// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tests of beliefs: a robot in a world file, three plans, and the comparison of decisions.

#ifndef STAGE_TESTS_SUPPORT_BELIEF_FIXTURE_HH
#define STAGE_TESTS_SUPPORT_BELIEF_FIXTURE_HH

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "stage.hh"

namespace Stg {

inline constexpr char kRobot[] =
    "resolution 0.05\n"
    "position( name \"r\" alwayson 1 size [0.4 0.4 0.4] round 1 drive \"diff\" localization "
    "\"gps\" )\n";

class BeliefFixture : public testing::Test {
 protected:
  BeliefFixture() {
    Init(nullptr, nullptr);
    const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
    file_ = testing::TempDir() + test.test_suite_name() + "_" + test.name() + ".world";
    Write(kRobot);
    question_.horizon = 4000000;
    question_.plans = {Plan("stand"), Plan("ahead", Velocity(0.5, 0, 0, 0)),
                       Plan("left", Velocity(0.5, 0, 0, 0.5))};
  }
  ~BeliefFixture() override { std::filesystem::remove(file_); }

  void Write(const std::string& text) const { std::ofstream(file_) << text; }
  static BeliefEngine::Options OptionsWith(uint32_t samples, unsigned threads = 1) {
    BeliefEngine::Options options;
    options.samples = samples;
    options.threads = threads;
    return options;
  }
  Decision Choose(Belief* belief, const BeliefEngine::Options& options) const {
    BeliefEngine engine(belief, options);
    EXPECT_TRUE(engine.IsReady());
    GoalJudge judge(5, 0, 0.2);
    return engine.Choose(question_, Budget(), &judge);
  }

  std::string file_;
  BeliefQuestion question_;
};

/// Expects that the scores and collisions of two decisions are equal.
inline void ExpectSame(const Decision& a, const Decision& b) {
  EXPECT_EQ(a.best, b.best);
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(a.scenario_steps, b.scenario_steps);
  ASSERT_EQ(a.outcomes.size(), b.outcomes.size());
  for (size_t i = 0; i < a.outcomes.size(); i++) {
    EXPECT_EQ(a.outcomes[i].scores, b.outcomes[i].scores) << i;
    EXPECT_EQ(a.outcomes[i].collided, b.outcomes[i].collided) << i;
  }
}

/// Expects that the first samples of all plans of two decisions went the same way.
inline void ExpectSameSightings(const Decision& a, const Decision& b) {
  ASSERT_EQ(a.outcomes.size(), b.outcomes.size());
  for (size_t i = 0; i < a.outcomes.size(); i++) {
    ASSERT_EQ(a.outcomes[i].sightings.size(), b.outcomes[i].sightings.size()) << i;
    for (size_t k = 0; k < a.outcomes[i].sightings.size(); k++)
      ASSERT_EQ(a.outcomes[i].sightings[k].pose, b.outcomes[i].sightings[k].pose) << i << " " << k;
  }
}

}  // namespace Stg

#endif
