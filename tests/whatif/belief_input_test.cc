// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where the world of a belief comes from, and input that makes no sense.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "messages/report.hh"
#include "stage.hh"
#include "support/belief_fixture.hh"

namespace Stg {
namespace {

constexpr char kWall[] = "model( name \"wall\" size [0.2 4 1] pose [2 0 0 0] )\n";

class BeliefInputTest : public BeliefFixture {};

TEST_F(BeliefInputTest, NumbersThatMakeNoSenseChangeNothing) {
  Belief belief(file_, "r");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(belief.SetRobot(Pose(nan, 0, 0, 0)));
  EXPECT_FALSE(belief.SetRobot(Pose(), Velocity(0, INFINITY, 0, 0)));
  EXPECT_EQ(belief.robot_pose().x, 0);
  Covariance wrong(0.1, 0.1, 0.1);
  wrong.values[1] = wrong.values[3] = 0.5;
  EXPECT_FALSE(belief.SetRobot(Pose(), Velocity(), wrong)) << "not positive";
  wrong.values[1] = 0.001;
  wrong.values[3] = -0.001;
  EXPECT_FALSE(belief.SetRobot(Pose(), Velocity(), wrong)) << "not symmetric";
  wrong.values[3] = 0.001;
  EXPECT_TRUE(belief.SetRobot(Pose(), Velocity(), wrong));
  TrackedOther other(1);
  other.behaviours = {Behaviour(Behaviour::kStand, 0)};
  EXPECT_FALSE(belief.SetOther(other));
  other.behaviours = {Behaviour(Behaviour::kGoTo, nan, 0)};
  EXPECT_FALSE(belief.SetOther(other));
  other.behaviours = {Behaviour(Behaviour::kGoTo, 0, 0, -1)};
  EXPECT_FALSE(belief.SetOther(other));
  for (const auto kind : {Behaviour::kGoTo, Behaviour::kSocialForce, Behaviour::kOrca}) {
    other.behaviours = {Behaviour(kind)};
    EXPECT_FALSE(belief.SetOther(other)) << kind << " without a goal";
  }
  EXPECT_TRUE(belief.others().empty());
  EXPECT_FALSE(belief.SetDelay(-1));
  EXPECT_FALSE(belief.SetDelay(nan));
}

TEST_F(BeliefInputTest, OptionsThatMakeNoSenseAreRefused) {
  const auto is_ready = [&](auto change) {
    Belief::Options options;
    options.columns = 80;
    options.rows = 60;
    change(&options);
    return Belief(file_, "r", options).IsReady();
  };
  EXPECT_TRUE(is_ready([](Belief::Options*) {}));
  EXPECT_FALSE(is_ready([](Belief::Options* o) { o->rows = 0; }));
  EXPECT_FALSE(is_ready([](Belief::Options* o) { o->columns = 10001; }));
  EXPECT_FALSE(is_ready([](Belief::Options* o) { o->resolution = 0; }));
  EXPECT_FALSE(is_ready([](Belief::Options* o) { o->wall_height = NAN; }));
  EXPECT_FALSE(is_ready([](Belief::Options* o) { o->kinds[0].radius = -1; }));
  EXPECT_FALSE(is_ready([](Belief::Options* o) { o->kinds[0].room = 1000000; }));
  EXPECT_FALSE(is_ready([](Belief::Options* o) { o->origin.x = INFINITY; }));
}

TEST_F(BeliefInputTest, WorldsMayBeTexts) {
  Belief::Options options;
  options.pictures = std::make_shared<const std::map<std::string, std::string>>(
      std::map<std::string, std::string>{{"wall.pbm", "P1\n1 1\n1\n"}});
  std::istringstream text(std::string(kRobot) +
                          "model( pose [1 0 0 0] size [0.2 1 1] bitmap \"wall.pbm\" )\n");
  Belief belief(text, "nowhere.world", "r", options);
  ASSERT_TRUE(belief.IsReady());
  EXPECT_EQ(Choose(&belief, OptionsWith(1)).outcomes[1].CollisionRisk(), 1);
}

TEST_F(BeliefInputTest, EnginesSayWhyTheyAreNotReady) {
  Write(std::string(kRobot) + "gripper( alwayson 1 )\n");
  Belief belief(file_, "r");
  ASSERT_TRUE(belief.IsReady());
  const messages::Collector collector;
  EXPECT_FALSE(BeliefEngine(&belief).IsReady());
  ASSERT_FALSE(collector.lines.empty());
  EXPECT_NE(collector.lines.back().find("cannot be simulated in rows, because"), std::string::npos);
}

TEST_F(BeliefInputTest, WhatCannotBeDecidedIsSaid) {
  EXPECT_FALSE(Belief(file_ + ".none", "r").IsReady());
  Belief none(file_, "s");
  EXPECT_FALSE(none.IsReady());
  GoalJudge judge(5, 0, 0.2);
  BeliefEngine unready(&none);
  EXPECT_FALSE(unready.IsReady());
  EXPECT_EQ(unready.Choose(question_, Budget(), &judge).error, "the belief is not ready");

  Write(std::string(kRobot) + kWall);
  Belief belief(file_, "r");
  BeliefEngine engine(&belief);
  belief.SetRobot(Pose(2, 1, 0, 0));
  EXPECT_NE(engine.Choose(question_, Budget(), &judge).error.find("in an obstacle"),
            std::string::npos);
  belief.SetRobot(Pose());
  question_.plans.push_back(Plan("aside", Velocity(0, 0.1, 0, 0)));
  EXPECT_NE(engine.Choose(question_, Budget(), &judge).error.find("sideways in the plan \"aside\""),
            std::string::npos);
  question_.plans.back() = Plan("mad", Velocity(NAN, 0, 0, 0));
  EXPECT_NE(engine.Choose(question_, Budget(), &judge).error.find("not finite"), std::string::npos);
  question_.plans.clear();
  EXPECT_EQ(engine.Choose(question_, Budget(), &judge).error, "there are no plans");
}

}  // namespace
}  // namespace Stg
