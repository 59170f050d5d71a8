// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/belief.hh"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "rows/device_rows.hh"
#include "stage.hh"
#include "support/belief_fixture.hh"
#include "support/device.hh"
#include "support/host_row_device.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

constexpr char kWall[] = "model( name \"wall\" size [0.2 4 1] pose [2 0 0 0] )\n";

class BeliefTest : public BeliefFixture {};

TrackedOther OtherAt(uint64_t id, const Pose& pose, const Velocity& velocity = Velocity()) {
  TrackedOther other(id);
  other.pose = pose;
  other.velocity = velocity;
  return other;
}

TEST_F(BeliefTest, WithoutOthersTheStraightWayIsBest) {
  Belief belief(file_, "r");
  ASSERT_TRUE(belief.IsReady());
  const Decision decision = Choose(&belief, OptionsWith(1));
  EXPECT_EQ(decision.error, "");
  EXPECT_EQ(question_.plans[decision.best].name, "ahead");
  // The distance is 5 - 0.05 k after k of 40 steps.
  EXPECT_NEAR(decision.outcomes[1].score, -(5 - 0.05 * 20.5), 1e-9);
  EXPECT_NEAR(decision.outcomes[0].score, -5, 1e-9);
}

TEST_F(BeliefTest, SomebodyInTheWayIsAvoided) {
  Belief belief(file_, "r");
  ASSERT_TRUE(belief.SetOther(OtherAt(3, Pose(1.2, 0, 0, 0))));
  const Decision decision = Choose(&belief, OptionsWith(1));
  EXPECT_EQ(question_.plans[decision.best].name, "left");
  EXPECT_EQ(decision.outcomes[1].CollisionRisk(), 1);
  ASSERT_TRUE(belief.RemoveOther(3));
  EXPECT_FALSE(belief.RemoveOther(3));
  EXPECT_EQ(question_.plans[Choose(&belief, OptionsWith(1)).best].name, "ahead");
}

TEST_F(BeliefTest, SomebodyWhoRunsIntoTheStandingRobotCollides) {
  Belief belief(file_, "r");
  ASSERT_TRUE(belief.SetOther(OtherAt(1, Pose(-2, 0, 0, 0), Velocity(1, 0, 0, 0))));
  EXPECT_EQ(Choose(&belief, OptionsWith(1)).outcomes[0].CollisionRisk(), 1);
  ASSERT_TRUE(belief.SetOther(OtherAt(1, Pose(-2, 0.7, 0, 0), Velocity(1, 0, 0, 0))));
  EXPECT_EQ(Choose(&belief, OptionsWith(1)).outcomes[0].CollisionRisk(), 0) << "he passes by";
}

class Onlooker : public Judge {
  bool NeedsWorld() const override { return false; }
};

/// A future without errors is what a World with the same robots does, bit for bit.
TEST_F(BeliefTest, FuturesAreThoseOfAWorld) {
  Write(std::string(kRobot) + kWall);
  Belief belief(file_, "r");
  belief.SetRobot(Pose(0.1, 0.2, 0, 0.3), Velocity(0.5, 0, 0, 0.5));
  belief.SetOther(OtherAt(1, Pose(0.7, 0.9, 0, 0), Velocity(-0.2, -0.2, 0, 0)));
  belief.SetOther(OtherAt(2, Pose(1.2, -0.9, 0, 0), Velocity(0.1, 0.4, 0, 0)));
  Onlooker judge;
  const Decision decision =
      BeliefEngine(&belief, OptionsWith(1)).Choose(question_, Budget(), &judge);
  const std::vector<Sighting>& seen = decision.outcomes[2].sightings;

  const char others[] =
      "define other position( alwayson 1 size [0.5 0.5 1.7] round 1 drive \"omni\" localization "
      "\"gps\" mass 70 velocity_bounds [-10 10 -10 10 0 0 -573 573] )\n"
      "other( name \"a\" pose [0.7 0.9 0 0] ctrl \"stage/behaviour kind=1 vx=-0.2 vy=-0.2\" )\n"
      "other( name \"b\" pose [1.2 -0.9 0 0] ctrl \"stage/behaviour kind=1 vx=0.1 vy=0.4\" )\n";
  const auto world = LoadText(std::string(kRobot) + kWall + others, 1);
  world->GetModel("r")->SetPose(Pose(0.1, 0.2, 0, 0.3));
  const auto drive = [&](const char* name, double x, double y, double a) {
    dynamic_cast<ModelPosition*>(world->GetModel(name))->SetSpeed(x, y, a);
  };
  drive("r", 0.5, 0, 0.5);
  drive("a", -0.2, -0.2, 0);
  drive("b", 0.1, 0.4, 0);
  const size_t watched = 1 + belief.options().kinds[0].room;
  ASSERT_EQ(seen.size(), 40 * watched);
  bool stalled = false;
  for (size_t step = 0; step < seen.size() / watched; step++) {
    world->Update();
    const Pose pose = world->GetModel("r")->GetGlobalPose();
    const Pose b = world->GetModel("b")->GetGlobalPose();
    EXPECT_EQ(seen[step * watched].pose.x, pose.x) << step;
    EXPECT_EQ(seen[step * watched].pose.y, pose.y) << step;
    EXPECT_EQ(seen[step * watched].pose.a, pose.a) << step;
    EXPECT_EQ(seen[step * watched + 2].pose.y, b.y) << step;
    stalled |= world->GetModel("r")->Stalled() || world->GetModel("a")->Stalled();
  }
  EXPECT_TRUE(stalled) << "the test should see contacts";
}

/// The robot passes a standing disc whose lateral place is known with an error of 0.2 m. They touch
/// if it is less than the sum of the radii aside: the probability follows from the normal
/// distribution.
TEST_F(BeliefTest, RisksAreThoseOfTheErrors) {
  Belief belief(file_, "r");
  question_.plans = {Plan("ahead", Velocity(0.5, 0, 0, 0))};
  for (const double aside : {0.0, 0.4, 0.6, 0.9}) {
    TrackedOther other = OtherAt(1, Pose(1.5, aside, 0, 0));
    other.pose_covariance = Covariance(0, 0.2, 0);
    other.behaviours = {Behaviour(Behaviour::kStand)};
    ASSERT_TRUE(belief.SetOther(other));
    const auto below = [&](double y) { return 0.5 * std::erfc(-(y - aside) / 0.2 / M_SQRT2); };
    const double wanted = below(0.45) - below(-0.45);
    const Decision decision = Choose(&belief, OptionsWith(1000, 2));
    const Interval found = decision.outcomes[0].CollisionInterval(3);
    EXPECT_LE(found.low, wanted) << aside;
    EXPECT_GE(found.high, wanted) << aside;
  }
}

TEST_F(BeliefTest, BehavioursAreDrawnByTheirWeights) {
  Belief belief(file_, "r");
  question_.plans = {Plan("stand")};
  TrackedOther other = OtherAt(1, Pose(-2, 0, 0, 0), Velocity(1, 0, 0, 0));
  other.behaviours = {Behaviour(Behaviour::kStand, 3), Behaviour(Behaviour::kGoOn, 1)};
  ASSERT_TRUE(belief.SetOther(other));
  const Interval found = Choose(&belief, OptionsWith(1000)).outcomes[0].CollisionInterval(3);
  EXPECT_LT(found.low, 0.25);
  EXPECT_GT(found.high, 0.25);
}

TEST_F(BeliefTest, TheRobotObeysAfterItsDelay) {
  Belief belief(file_, "r");
  ASSERT_TRUE(belief.SetDelay(0.25));
  belief.SetRobot(Pose(), Velocity(0.2, 0, 0, 0));
  const size_t watched = 1 + belief.options().kinds[0].room;
  const Decision decision = Choose(&belief, OptionsWith(1));
  const std::vector<Sighting>& ahead = decision.outcomes[1].sightings;
  EXPECT_NEAR(ahead[2 * watched].pose.x, 0.06, 1e-9) << "0.25 s are three steps";
  EXPECT_NEAR(ahead[4 * watched].pose.x, 0.16, 1e-9);
}

/// All plans meet the same futures of the others, and nobody's errors depend on how many others
/// there are, or in which order they were told.
TEST_F(BeliefTest, RandomNumbersBelongToSamplesAndOthers) {
  const auto noisy = [](uint64_t id, double x) {
    TrackedOther other = OtherAt(id, Pose(x, 1, 0, 0));
    other.pose_covariance = Covariance(0.3, 0.3, 0.1);
    return other;
  };
  Belief one(file_, "r"), two(file_, "r");
  one.SetOther(noisy(7, 1));
  one.SetOther(noisy(5, 30));
  two.SetOther(noisy(5, 30));
  two.SetOther(noisy(7, 1));
  two.SetOther(noisy(6, 40));
  const auto options = OptionsWith(5);
  const Decision first = Choose(&one, options), second = Choose(&two, options);
  for (size_t plan = 0; plan < 3; plan++)
    EXPECT_EQ(first.outcomes[plan].scores, second.outcomes[plan].scores);
  const size_t watched = 1 + one.options().kinds[0].room;
  const auto place = [&](size_t plan) { return first.outcomes[plan].sightings[2 + watched].pose; };
  EXPECT_EQ(place(0).x, place(1).x);
  EXPECT_NE(place(0).x, 1);
}

Belief& MakeCrowd(Belief* belief, uint64_t count) {
  belief->SetRobot(Pose(0, 0, 0, 0.1), Velocity(0.2, 0, 0, 0), Covariance(0.05, 0.05, 0.02),
                   Covariance(0.02, 0, 0.02));
  for (uint64_t id = 0; id < count; id++) {
    const SineCosine turn = SinCos(static_cast<double>(id));
    TrackedOther other = OtherAt(id, Pose(2 * turn.cosine, 2 * turn.sine, 0, 0),
                                 Velocity(-0.6 * turn.cosine, -0.5 * turn.sine, 0, 0));
    other.pose_covariance = Covariance(0.1, 0.1, 0.1);
    other.velocity_covariance = Covariance(0.1, 0.1, 0);
    other.behaviours = {Behaviour(Behaviour::kStand), Behaviour(Behaviour::kGoOn)};
    belief->SetOther(other);
  }
  return *belief;
}

TEST_F(BeliefTest, DecisionsAreTheSameOnAnyNumberOfThreadsAndOnDevices) {
  Write(std::string(kRobot) + kWall);
  Belief belief(file_, "r");
  const Decision wanted = Choose(&MakeCrowd(&belief, 5), OptionsWith(20));
  EXPECT_GT(wanted.outcomes[1].CollisionRisk(), 0);
  EXPECT_LT(wanted.outcomes[0].CollisionRisk(), 1);
  for (const unsigned threads : {2u, 5u})
    ExpectSame(Choose(&belief, OptionsWith(20, threads)), wanted);
  if (!device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  BeliefEngine::Options options = OptionsWith(20);
  options.device_steps = true;
  BeliefEngine engine(&belief, options);
  ASSERT_TRUE(engine.IsReady());
  ASSERT_FALSE(engine.StepDevice().empty());
  GoalJudge judge(5, 0, 0.2);
  for (int again = 0; again < 2; again++)
    ExpectSame(engine.Choose(question_, Budget(), &judge), wanted);
  EXPECT_EQ(engine.steps_on_device(), 2 * wanted.scenario_steps);
}

/// Devices by `make` during a test.
class DevicesAre {
 public:
  explicit DevicesAre(const std::function<std::unique_ptr<rows::RowDevice>()>& make) {
    rows::ReplaceRowDevices(make);
  }
  ~DevicesAre() { rows::ReplaceRowDevices(nullptr); }
};

/// Plans with a command in each third step, after a delay.
void GiveManyCommands(Belief* belief, BeliefQuestion* question) {
  ASSERT_TRUE(belief->SetDelay(0.2));
  question->hold = 300000;
  for (size_t i = 0; i < question->plans.size(); i++)
    for (int k = 0; k < 12; k++)
      question->plans[i].commands.emplace_back(0.2 + 0.1 * static_cast<double>((i + k) % 4), 0, 0,
                                               0.4 * (k % 3 - 1));
}

/// A device makes many steps before the host looks at them: commands are given, and futures end, in
/// between.
TEST_F(BeliefTest, CommandsAndEndsBetweenLooksAreThoseOfTheHost) {
  Write(std::string(kRobot) + kWall);
  Belief belief(file_, "r");
  MakeCrowd(&belief, 5);
  GiveManyCommands(&belief, &question_);
  const Decision wanted = Choose(&belief, OptionsWith(20));
  EXPECT_GT(wanted.outcomes[1].CollisionRisk(), 0);
  EXPECT_LT(wanted.outcomes[0].CollisionRisk(), 1);
  const DevicesAre devices([] { return std::make_unique<test::HostRowDevice>(); });
  BeliefEngine::Options options = OptionsWith(20);
  options.device_steps = true;
  for (const uint64_t round : {1u, 5u, 7u, 100u}) {
    options.round = round;
    const Decision found = Choose(&belief, options);
    ExpectSame(found, wanted);
    ExpectSameSightings(found, wanted);
  }
}

TEST_F(BeliefTest, DecisionsAreTheSameWhenTheDeviceIsLostAtAnyTime) {
  Write(std::string(kRobot) + kWall);
  Belief belief(file_, "r");
  MakeCrowd(&belief, 2);
  GiveManyCommands(&belief, &question_);
  const Decision wanted = Choose(&belief, OptionsWith(5));
  BeliefEngine::Options options = OptionsWith(5);
  options.device_steps = true;
  options.round = 11;
  size_t warnings = 0;
  SetLogSink([&](LogLevel, const std::string& line) {
    warnings += line.find("because the device is lost") != std::string::npos;
  });
  for (int calls = 0; calls < 150; calls++) {
    const DevicesAre devices(
        [=] { return std::make_unique<test::LostRowDevice>(std::make_shared<int>(calls)); });
    const Decision found = Choose(&belief, options);
    ExpectSame(found, wanted);
    ExpectSameSightings(found, wanted);
  }
  SetLogSink(nullptr);
  EXPECT_GT(warnings, 100u);
}

Belief::Options WithGrid() {
  Belief::Options options;
  options.columns = 80;
  options.rows = 60;
  options.resolution = 0.1;
  options.origin = Pose(-2, -3, 0, 0);
  return options;
}

/// A wall of 0.2 m across the way, from row `first` on.
std::vector<uint8_t> CellsWithWall(size_t first) {
  std::vector<uint8_t> cells(80 * 60, 0);
  for (size_t row = first; row < 60; row++) cells[row * 80 + 35] = cells[row * 80 + 36] = 1;
  return cells;
}

TEST_F(BeliefTest, TheGridIsAnObstacle) {
  Belief belief(file_, "r", WithGrid());
  BeliefEngine engine(&belief, OptionsWith(1));
  GoalJudge judge(5, 0, 0.2);
  question_.plans.push_back(Plan("right", Velocity(0.5, 0, 0, -0.5)));
  const auto name = [&] {
    const Decision decision = engine.Choose(question_, Budget(), &judge);
    return decision.error.empty() ? question_.plans[decision.best].name : decision.error;
  };
  EXPECT_EQ(name(), "ahead");
  const std::vector<uint8_t> wall = CellsWithWall(25);
  ASSERT_TRUE(belief.SetGrid(wall.data(), wall.size()));
  EXPECT_EQ(engine.Choose(question_, Budget(), &judge).outcomes[1].CollisionRisk(), 1);
  EXPECT_NE(name(), "ahead");
  EXPECT_EQ(engine.Choose(question_, Budget(), &judge).error, "");
  const std::vector<uint8_t> none(80 * 60, 0), full(80 * 60, 1);
  ASSERT_TRUE(belief.SetGrid(none.data(), none.size()));
  EXPECT_EQ(name(), "ahead");
  ASSERT_TRUE(belief.SetGrid(full.data(), full.size()));
  EXPECT_NE(name().find("in an obstacle"), std::string::npos);
  EXPECT_FALSE(belief.SetGrid(full.data(), 7));
}

/// Units of the world file are those of its own numbers only.
TEST_F(BeliefTest, SomebodyDeepInAnObstacleStands) {
  Belief belief(file_, "r", WithGrid());
  std::vector<uint8_t> cells(80 * 60, 0);
  for (size_t row = 20; row < 40; row++)
    for (size_t column = 40; column < 60; column++) cells[row * 80 + column] = 1;
  belief.SetGrid(cells.data(), cells.size());
  belief.SetOther(OtherAt(1, Pose(3, 0, 0, 0), Velocity(-1, 0, 0, 0)));
  const Decision decision = Choose(&belief, OptionsWith(1));
  EXPECT_EQ(decision.outcomes[0].sightings.back().pose.x, -10000) << "far away";
  const size_t watched = 1 + belief.options().kinds[0].room;
  EXPECT_EQ(decision.outcomes[0].sightings[39 * watched + 1].pose.x, 3);
}

/// A person whom the robot's sensors see is in the grid, too, and is not to be stopped by that.
TEST_F(BeliefTest, OthersMayClearCells) {
  std::vector<uint8_t> cells(80 * 60, 0);
  for (size_t row = 28; row < 32; row++)
    for (size_t column = 48; column < 52; column++) cells[row * 80 + column] = 1;
  const auto end_of = [&](bool clears) {
    Belief::Options options = WithGrid();
    options.others_clear_cells = clears;
    Belief belief(file_, "r", options);
    BeliefEngine engine(&belief, OptionsWith(1));
    GoalJudge judge(5, 5, 0.2);
    belief.SetGrid(cells.data(), cells.size());
    double x = 0;
    for (const double start : {5.0, 3.0}) {
      belief.SetOther(OtherAt(1, Pose(start, 0, 0, 0), Velocity(0, 0.5, 0, 0)));
      const Decision decision = engine.Choose(question_, Budget(), &judge);
      EXPECT_EQ(decision.error, "");
      x = decision.outcomes[0].sightings[39 * 9 + 1].pose.y;
    }
    // Cells come back when the other has gone.
    belief.ClearOthers();
    question_.plans[1].commands[0].x = 1;
    EXPECT_EQ(engine.Choose(question_, Budget(), &judge).outcomes[1].CollisionRisk(), 1);
    question_.plans[1].commands[0].x = 0.5;
    return x;
  };
  EXPECT_LT(end_of(false), 0.5);
  EXPECT_NEAR(end_of(true), 2, 1e-9);
}

TEST_F(BeliefTest, WorldFilesMayHaveAnyUnits) {
  const char robot[] =
      "position( name \"r\" alwayson 1 round 1 drive \"diff\" localization \"gps\" ";
  const std::string files[] = {
      std::string("resolution 0.05\n") + robot + "size [0.4 0.4 0.4] pose [0.5 -1 0 90] )",
      std::string("resolution 0.05 unit_angle \"radians\"\n") + robot +
          "size [0.4 0.4 0.4] pose [0.5 -1 0 1.5707963267948966] )",
      std::string("resolution 5 unit_length \"cm\"\n") + robot +
          "size [40 40 40] pose [50 -100 0 90] )"};
  Belief::Options turned = WithGrid();
  turned.origin = Pose(1, -3, 0, 0.4);
  std::vector<Decision> found;
  for (const std::string& file : files) {
    Write(file);
    Belief belief(file_, "r", turned);
    ASSERT_TRUE(belief.IsReady());
    EXPECT_NEAR(belief.robot_pose().a, M_PI / 2, 1e-12);
    const std::vector<uint8_t> wall = CellsWithWall(25);
    belief.SetGrid(wall.data(), wall.size());
    belief.SetOther(OtherAt(1, Pose(0.5, 1, 0, 0)));
    found.push_back(Choose(&belief, OptionsWith(1)));
    EXPECT_EQ(found.back().error, "");
    EXPECT_EQ(found.back().outcomes[1].CollisionRisk(), 1);
    ASSERT_EQ(found.back().outcomes.size(), found[0].outcomes.size());
    for (size_t i = 0; i < found[0].outcomes.size(); i++)
      EXPECT_NEAR(found.back().outcomes[i].score, found[0].outcomes[i].score, 1e-6) << file;
  }
}

/// A device gets each changed grid.
TEST_F(BeliefTest, DecisionsWithAGridAreTheSameOnDevices) {
  if (!device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  Belief belief(file_, "r", WithGrid());
  MakeCrowd(&belief, 5);
  BeliefEngine::Options options = OptionsWith(6);
  BeliefEngine host(&belief, options);
  options.device_steps = true;
  BeliefEngine on_device(&belief, options);
  GoalJudge judge(5, 0, 0.2);
  std::vector<Decision> found;
  for (const size_t first : {60u, 25u, 40u, 25u}) {
    const std::vector<uint8_t> cells = CellsWithWall(first);
    ASSERT_TRUE(belief.SetGrid(cells.data(), cells.size()));
    found.push_back(host.Choose(question_, Budget(), &judge));
    ExpectSame(on_device.Choose(question_, Budget(), &judge), found.back());
  }
  EXPECT_GT(on_device.steps_on_device(), 0u);
  EXPECT_NE(found[0].outcomes[1].scores, found[1].outcomes[1].scores);
  ExpectSame(found[3], found[1]);
}

TEST_F(BeliefTest, OthersGoToTheirGoals) {
  Belief belief(file_, "r");
  question_.plans = {Plan("stand")};
  question_.horizon = 6000000;
  belief.SetRobot(Pose(0, -20, 0, 0));
  const Behaviour::Kind kinds[] = {Behaviour::kGoTo, Behaviour::kSocialForce, Behaviour::kOrca};
  for (uint64_t i = 0; i < 3; i++) {
    TrackedOther other = OtherAt(i, Pose(0, 5.0 * static_cast<double>(i), 0, 0));
    other.behaviours = {Behaviour(kinds[i], 2, 5.0 * static_cast<double>(i), 0.8)};
    ASSERT_TRUE(belief.SetOther(other));
  }
  const std::vector<Sighting> seen = Choose(&belief, OptionsWith(1)).outcomes[0].sightings;
  for (size_t i = 0; i < 3; i++) {
    const Sighting& last = seen[seen.size() - 1 - belief.options().kinds[0].room + 1 + i];
    EXPECT_NEAR(last.pose.x, 2, 0.25) << i;
    EXPECT_NEAR(last.pose.y, 5.0 * static_cast<double>(i), 0.05) << i;
  }
}

/// Two who walk towards each other pass if they evade, and touch if they go straight.
TEST_F(BeliefTest, OthersEvadeEachOther) {
  Belief belief(file_, "r");
  question_.plans = {Plan("stand")};
  question_.horizon = 6000000;
  belief.SetRobot(Pose(0, -20, 0, 0));
  for (const Behaviour::Kind kind : {Behaviour::kGoTo, Behaviour::kSocialForce, Behaviour::kOrca}) {
    for (uint64_t i = 0; i < 2; i++) {
      const double x = i == 0 ? -2 : 2;
      TrackedOther other = OtherAt(i, Pose(x, 0.05 * x, 0, 0), Velocity(-0.4 * x, 0, 0, 0));
      other.behaviours = {Behaviour(kind, -x, -0.05 * x)};
      ASSERT_TRUE(belief.SetOther(other));
    }
    const std::vector<Sighting> seen = Choose(&belief, OptionsWith(1)).outcomes[0].sightings;
    const size_t watched = 1 + belief.options().kinds[0].room;
    bool touched = false;
    for (size_t step = 0; step < seen.size() / watched; step++)
      touched |= seen[step * watched + 1].stalled;
    EXPECT_EQ(touched, kind == Behaviour::kGoTo) << kind;
  }
}

TEST_F(BeliefTest, DecisionsAreReplayed) {
  Belief belief(file_, "r");
  MakeCrowd(&belief, 5);
  BeliefEngine::Options options = OptionsWith(4, 2);
  options.most_samples = 32;
  BeliefEngine engine(&belief, options);
  GoalJudge judge(5, 0, 0.2);
  for (const uint64_t steps : {0, 200, 2000}) {
    Budget budget;
    budget.scenario_steps = steps;
    const Decision decision = engine.Choose(question_, budget, &judge);
    ExpectSame(engine.Replay(question_, decision, &judge), decision);
    EXPECT_TRUE(steps == 0 || decision.scenario_steps <= steps);
  }
}

TEST_F(BeliefTest, ManyChangesOfTheNumberOfOthersTakeNoMoreMemory) {
  Belief belief(file_, "r");
  BeliefEngine engine(&belief, OptionsWith(2));
  GoalJudge judge(5, 0, 0.2);
  question_.horizon = 200000;
  size_t used = 0, before = 0;
  const auto run = [&](uint64_t rounds) {
    for (uint64_t round = 0; round < rounds; round++) {
      belief.ClearOthers();
      MakeCrowd(&belief, (round * 7) % 20);
      ASSERT_EQ(engine.Choose(question_, Budget(), &judge).error, "");
    }
    const struct mallinfo2 now = mallinfo2();
    before = used;
    used = now.uordblks + now.hblkhd;
  };
  run(40);
  run(1000);
  EXPECT_LT(used, before + 20000);
}

}  // namespace
}  // namespace Stg
