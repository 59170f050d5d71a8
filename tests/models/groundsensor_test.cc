// SPDX-License-Identifier: GPL-2.0-or-later
//
// Ground sensors: the instant and the place of their values, noise, deposits, and properties.

#include <cmath>

#include "support/model_testing.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

/// The value of each cell is the x of its middle, so that interpolated values are places.
void MakeRamp(ModelField* field) {
  std::vector<double> values;
  for (size_t i = 0; i < field->values().size(); i++)
    values.push_back((static_cast<double>(i % field->columns()) + 0.5) * field->CellWidth() -
                     field->GetGeom().size.x / 2);
  ASSERT_TRUE(field->SetValues(values.data(), values.size()));
}

const char kRobotOnRamp[] =
    "field( name \"ramp\" size [10 4 0] field_resolution 0.1 )\n"
    "position( name \"r\" size [0.2 0.2 0.2] alwayson 1\n"
    "  groundsensor( name \"g\" pose [0.05 0 0 0] points 2 point[1] [0.1 0.2] alwayson 1 ) )\n";

TEST(GroundSensor, ValuesBelongToTheSensedInstant) {
  const auto world = LoadText(kRobotOnRamp);
  MakeRamp(Find<ModelField>(*world, "ramp"));
  const auto* const sensor = Find<ModelGroundSensor>(*world, "r.g");
  auto* const robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(1, 0, 0);
  EXPECT_TRUE(sensor->GetValues().empty()) << "before the first update";
  for (int i = 0; i < 12; i++) {
    Step(*world);
    ASSERT_EQ(sensor->GetValues().size(), 2u);
    EXPECT_NEAR(sensor->GetValues()[0], robot->GetSensedPose().x + 0.05, 1e-12);
    EXPECT_NEAR(sensor->GetValues()[1], robot->GetSensedPose().x + 0.15, 1e-12);
    EXPECT_NEAR(robot->GetSensedPose().x, robot->GetPose().x - 0.1, 1e-12);
  }
}

TEST(GroundSensor, TurnsWithItsRobot) {
  const auto world = LoadText(kRobotOnRamp);
  MakeRamp(Find<ModelField>(*world, "ramp"));
  Find(*world, "r")->SetPose(Pose(1, 1, 0, M_PI / 2));
  Step(*world);
  const auto* const sensor = Find<ModelGroundSensor>(*world, "r.g");
  EXPECT_NEAR(sensor->GetValues()[0], 1, 1e-12);
  EXPECT_NEAR(sensor->GetValues()[1], 1 - 0.2, 1e-12);
}

TEST(GroundSensor, NearestReadsTheCell) {
  const auto world = LoadText(
      "field( name \"ramp\" size [10 4 0] field_resolution 0.1 )\n"
      "groundsensor( name \"g\" pose [0.19 0 0 0] interpolation \"nearest\" alwayson 1 )\n"
      "groundsensor( name \"away\" pose [7 0 0 0] alwayson 1 )\n");
  MakeRamp(Find<ModelField>(*world, "ramp"));
  Step(*world);
  EXPECT_NEAR(Find<ModelGroundSensor>(*world, "g")->GetValues()[0], 0.15, 1e-12);
  EXPECT_EQ(Find<ModelGroundSensor>(*world, "away")->GetValues()[0], 0) << "outside";
}

TEST(GroundSensor, ReadsTheNamedFieldOrTheFirst) {
  const auto world = LoadText(
      "groundsensor( name \"first\" alwayson 1 )\ngroundsensor( name \"second\" field \"b\" "
      "alwayson 1 )\nfield( name \"a\" initial 3 )\nfield( name \"b\" initial 4 )\n");
  Step(*world);
  const auto value = [&](const char* name) {
    return Find<ModelGroundSensor>(*world, name)->GetValues()[0];
  };
  EXPECT_EQ(value("first"), 3);
  EXPECT_EQ(value("second"), 4);
  delete Find(*world, "a");
  Step(*world);
  EXPECT_EQ(value("first"), 4);
  delete Find(*world, "b");
  Step(*world);
  EXPECT_EQ(value("second"), 0);
}

TEST(GroundSensor, NoiseHasItsDeviationAndAStreamOfItsOwn) {
  const std::string text =
      "field( initial 5 )\ngroundsensor( name \"g\" noise 0.5 alwayson 1 )\n"
      "groundsensor( name \"h\" noise 0.5 alwayson 1 )\n";
  const auto world = LoadText(text);
  const auto *const g = Find<ModelGroundSensor>(*world, "g"), *const h = Find<ModelGroundSensor>(
                                                                  *world, "h");
  double sum = 0, squares = 0, product = 0;
  constexpr int kSteps = 4000;
  for (int i = 0; i < kSteps; i++) {
    Step(*world);
    const double error = g->GetValues()[0] - 5;
    sum += error;
    squares += error * error;
    product += error * (h->GetValues()[0] - 5);
  }
  EXPECT_NEAR(sum / kSteps, 0, 0.03);
  EXPECT_NEAR(std::sqrt(squares / kSteps), 0.5, 0.02);
  EXPECT_NEAR(product / kSteps, 0, 0.02) << "independent";

  const auto other_seed = LoadText(text, 77);
  Step(*other_seed);
  const auto again = LoadText(text, 77);
  Step(*again);
  const double value = Find<ModelGroundSensor>(*other_seed, "g")->GetValues()[0];
  EXPECT_EQ(value, Find<ModelGroundSensor>(*again, "g")->GetValues()[0]);
}

TEST(GroundSensor, ANewSeedOfTheWorldChangesTheNoise) {
  const auto world = LoadText("field( )\ngroundsensor( name \"g\" noise 0.5 alwayson 1 )\n");
  Step(*world);
  Snapshot start;
  ASSERT_TRUE(world->Take(&start));
  const auto value = [&](uint64_t seed) {
    EXPECT_TRUE(world->Restore(start));
    if (seed > 0) world->Reseed(seed);
    Step(*world);
    return Find<ModelGroundSensor>(*world, "g")->GetValues()[0];
  };
  const double without = value(0), one = value(1), two = value(2);
  EXPECT_NE(one, without);
  EXPECT_NE(one, two);
  EXPECT_EQ(value(1), one);
}

// ---- deposits -----------------------------------------------------------------------------------

TEST(GroundSensor, DepositsWhereItIsAfterTheMoves) {
  const auto world = LoadText(
      "field( name \"f\" size [10 4 0] field_resolution 0.1 )\n"
      "position( name \"r\" size [0.2 0.2 0.2] alwayson 1\n"
      "  groundsensor( name \"g\" pose [0.05 0.05 0 0] deposit_rate 2 ) )\n");
  const auto* const field = Find<ModelField>(*world, "f");
  auto* const sensor = Find<ModelGroundSensor>(*world, "r.g");
  Find<ModelPosition>(*world, "r")->SetSpeed(1, 0, 0);
  Step(*world, 3);
  EXPECT_NEAR(field->Integral(), 0.6, 1e-12) << "without subscribers, too";
  for (const double x : {0.15, 0.25, 0.35}) EXPECT_NEAR(field->NearestValue(x, 0.05), 20, 1e-9);
  EXPECT_EQ(field->NearestValue(0.05, 0.05), 0);
  EXPECT_TRUE(sensor->SetDepositRate(0));
  EXPECT_TRUE(sensor->Deposit(1));
  EXPECT_TRUE(sensor->Deposit(0.5));
  EXPECT_EQ(sensor->pending_deposit(), 1.5);
  Step(*world, 2);
  EXPECT_NEAR(field->Integral(), 2.1, 1e-12);
  EXPECT_NEAR(field->NearestValue(0.45, 0.05), 150, 1e-9);
  EXPECT_EQ(sensor->pending_deposit(), 0);
  EXPECT_FALSE(sensor->Deposit(NAN));
  EXPECT_FALSE(sensor->SetDepositRate(INFINITY));
  EXPECT_EQ(sensor->deposit_rate(), 0);
}

TEST(GroundSensor, ReadsAndDepositsAtItsOrigin) {
  const auto world = LoadText(
      "field( name \"f\" size [10 4 0] field_resolution 0.1 )\n"
      "groundsensor( name \"g\" origin [2.05 0.05 0 0] pose [1 0 0 0] deposit_rate 10\n"
      "  alwayson 1 interpolation \"nearest\" )\n");
  Step(*world, 2);
  EXPECT_NEAR(Find<ModelField>(*world, "f")->NearestValue(3.05, 0.05), 200, 1e-9);
  EXPECT_NEAR(Find<ModelGroundSensor>(*world, "g")->GetValues()[0], 100, 1e-9);
}

TEST(GroundSensor, SensesADepositInTheNextStep) {
  const auto world =
      LoadText("field( size [1 1 0] field_resolution 1 )\ngroundsensor( name \"g\" alwayson 1 )\n");
  auto* const sensor = Find<ModelGroundSensor>(*world, "g");
  sensor->Deposit(7);
  Step(*world);
  EXPECT_EQ(sensor->GetValues()[0], 0);
  Step(*world);
  EXPECT_EQ(sensor->GetValues()[0], 7);
}

TEST(GroundSensor, RobotsFollowWhatOthersHaveLeft) {
  const auto world = LoadText(
      "field( name \"trail\" size [8 4 0] diffusion 0.001 evaporation 0.05 )\n"
      "position( name \"first\" size [0.2 0.2 0.2] alwayson 1\n"
      "  groundsensor( deposit_rate 1 ) )\n"
      "position( name \"second\" pose [0 1 0 0] size [0.2 0.2 0.2] alwayson 1"
      "\n  groundsensor( name \"g\" points 2 point[0] [0 -1] alwayson 1 ) )\n");
  for (const char* name : {"first", "second"})
    Find<ModelPosition>(*world, name)->SetSpeed(0.5, 0, 0);
  Step(*world, 40);
  const auto* const sensor = Find<ModelGroundSensor>(*world, "second.g");
  EXPECT_GT(sensor->GetValues()[0], 1);
  EXPECT_LT(sensor->GetValues()[1], 1e-6);
}

// ---- properties ---------------------------------------------------------------------------------

TEST(GroundSensor, MistakesAreOneLineWithTheirPlace) {
  const std::pair<const char*, const char*> kMistakes[] = {
      {"field \"smell\"", "found the field \"smell\", expected the name of a field (\"f\")"},
      {"points 0", "found 0 points, expected a number from 1 to 10000"},
      {"points 20000", "found 20000 points"},
      {"interpolation \"cubic\"", "expected \"linear\" or \"nearest\""},
      {"noise -1", "found a negative number"},
  };
  for (const auto& [properties, message] : kMistakes) {
    const LoadOutcome outcome =
        TryToLoad("field( name \"f\" )\ngroundsensor( " + std::string(properties) + " )\n");
    EXPECT_FALSE(outcome.loaded) << properties;
    EXPECT_NE(outcome.errors.find(message), std::string::npos) << outcome.errors;
    EXPECT_EQ(outcome.errors.rfind("t.world:2:", 0), 0u) << outcome.errors;
    EXPECT_EQ(std::ranges::count(outcome.errors, '\n'), 1) << outcome.errors;
  }
  EXPECT_NE(TryToLoad("groundsensor( field \"f\" )\n").errors.find("(there is none)"),
            std::string::npos);
  EXPECT_TRUE(TryToLoad("groundsensor( alwayson 1 )\n").loaded) << "robots may have one";
}

}  // namespace
}  // namespace Stg
