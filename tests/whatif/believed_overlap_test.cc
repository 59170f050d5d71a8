// SPDX-License-Identifier: GPL-2.0-or-later
//
// Others who are believed to be where the robot is: they are beside it in futures.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/belief_fixture.hh"

namespace Stg {
namespace {

constexpr double kTouching = 0.2 + 0.25;  // m, between the centres

class BelievedOverlapTest : public BeliefFixture {
 protected:
  BelievedOverlapTest() {
    question_.horizon = 2000000;
    question_.plans = {Plan("stand"), Plan("ahead", Velocity(0.5, 0, 0, 0)),
                       Plan("back", Velocity(-0.5, 0, 0, 0))};
  }

  static TrackedOther At(double x, double y, Behaviour::Kind kind = Behaviour::kStand,
                         double vx = 0) {
    TrackedOther other(1);
    other.pose = Pose(x, y, 0, 0);
    other.velocity = Velocity(vx, 0, 0, 0);
    other.behaviours = {Behaviour(kind)};
    return other;
  }
  /// The risk of each plan if this is believed.
  std::vector<double> RisksOf(const TrackedOther& other) {
    Belief belief(file_, "r");
    EXPECT_TRUE(belief.SetRobot(Pose()));
    EXPECT_TRUE(belief.SetOther(other));
    decision_ = Choose(&belief, OptionsWith(16));
    EXPECT_EQ(decision_.error, "");
    std::vector<double> risks;
    for (const Outcome& outcome : decision_.outcomes) risks.push_back(outcome.CollisionRisk());
    return risks;
  }
  /// The pose of the other after the first step, if the robot stands.
  Pose FirstOfOther() const { return decision_.outcomes[0].sightings[1].pose; }

  Decision decision_;
};

TEST_F(BelievedOverlapTest, OnlyPlansThatDriveIntoSomebodyBesideTheRobotCollide) {
  EXPECT_EQ(RisksOf(At(0.1, 0)), (std::vector<double>{0, 1, 0}));
  EXPECT_EQ(RisksOf(At(-0.3, 0)), (std::vector<double>{0, 0, 1}));
}

TEST_F(BelievedOverlapTest, SomebodyWhoGoesOnIntoTheRobotCollides) {
  EXPECT_EQ(RisksOf(At(0.3, 0, Behaviour::kGoOn, -0.4)), (std::vector<double>{1, 1, 0}));
  EXPECT_EQ(RisksOf(At(0.3, 0, Behaviour::kGoOn, 0.6)), (std::vector<double>{0, 0, 0}));
}

TEST_F(BelievedOverlapTest, TheyAreBesideTheRobotInTheDirectionOfTheirPlace) {
  for (int i = 0; i < 12; i++) {
    const double angle = i * M_PI / 6 - M_PI + 0.1;
    RisksOf(At(0.2 * cos(angle), 0.2 * sin(angle)));
    EXPECT_NEAR(FirstOfOther().x, kTouching * cos(angle), 1e-9) << i;
    EXPECT_NEAR(FirstOfOther().y, kTouching * sin(angle), 1e-9) << i;
  }
}

TEST_F(BelievedOverlapTest, SomebodyAtThePlaceOfTheRobotIsInFrontOfIt) {
  EXPECT_EQ(RisksOf(At(0, 0)), (std::vector<double>{0, 1, 0}));
  EXPECT_NEAR(FirstOfOther().x, kTouching, 1e-9);
}

TEST_F(BelievedOverlapTest, TheyAreNotInWalls) {
  Write(std::string(kRobot) + "model( pose [0.5 0 0 0] size [0.4 4 1] )\n");
  RisksOf(At(0.1, 0.02));
  EXPECT_LE(FirstOfOther().x, 0.3 - 0.25 + 1e-9);
  EXPECT_NEAR(hypot(FirstOfOther().x, FirstOfOther().y), kTouching, 1e-9);
}

TEST_F(BelievedOverlapTest, UncertainPlacesAreDrawnAgainInstead) {
  TrackedOther other = At(0.44, 0);
  other.pose_covariance = Covariance(0.1, 0.1);
  const std::vector<double> risks = RisksOf(other);
  EXPECT_EQ(risks[0], 0);
  EXPECT_GT(risks[1], 0.9);
  EXPECT_GT(hypot(FirstOfOther().x, FirstOfOther().y), kTouching);
}

}  // namespace
}  // namespace Stg
