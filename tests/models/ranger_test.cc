// SPDX-License-Identifier: GPL-2.0-or-later
//
// The ranger: its readings, their times and noise, and the models that it sees.

#include <algorithm>
#include <cmath>

#include "ranger_testing.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

// ---- data ---------------------------------------------------------------------------------------

TEST(Sensor, DefaultsAreThoseOfStage) {
  const Sensor s;
  ExpectPose(s.pose, 0, 0, 0, 0);
  EXPECT_EQ(s.size.z, 0.02);
  EXPECT_EQ(s.range.min, 0);
  EXPECT_EQ(s.range.max, 5);
  EXPECT_EQ(s.fov, 0.1);
  EXPECT_EQ(s.sample_count, 1u);
  EXPECT_EQ(s.range_noise_const, 0);
  EXPECT_EQ(s.color.b, 1);
  EXPECT_EQ(s.color.a, 0.15);
  EXPECT_TRUE(s.ranges.empty() && s.intensities.empty() && s.bearings.empty());
}

TEST(Ranger, HasNoBodyAndNoSensorsOfItsOwn) {
  const auto world =
      LoadText("ranger( name \"l\" alwayson 1 )\nranger( name \"m\" pose [1 0 0 0] )");
  Step(*world);
  const ModelRanger* ranger = Find<ModelRanger>(*world, "l");
  EXPECT_TRUE(ranger->GetSensors().empty());
  EXPECT_EQ(ranger->GetGeom().size.x, 0.15);
  EXPECT_EQ(ranger->GetGeom().size.y, 0.15);
  EXPECT_EQ(ranger->GetGeom().size.z, 0.2);
  EXPECT_EQ(ranger->GetColor().b, 0.5);
  Find(*world, "m")->SetPose(Pose(0, 0, 0, 0));
  EXPECT_FALSE(Find(*world, "m")->HasCollision());
}

TEST(Ranger, SamplesSpanTheFieldOfViewFromTheRight) {
  Scene scene("sensor( fov 90 samples 3 range [0 6] )", "model( pose [2 2 0 0] size [1 1 1] )");
  Step(*scene.world);
  const Sensor& s = scene.sensor();
  ASSERT_EQ(s.bearings.size(), 3u);
  EXPECT_EQ(s.bearings[0], -M_PI / 4);
  EXPECT_EQ(s.bearings[1], 0);
  EXPECT_EQ(s.bearings[2], M_PI / 4);
  EXPECT_EQ(s.ranges[0], 6);
  EXPECT_EQ(s.ranges[1], 6);
  EXPECT_NEAR(s.ranges[2], 1.5 * std::sqrt(2.0), 2 * kCell);
  EXPECT_EQ(s.intensities, (std::vector<double>{0, 0, 1}));
}

TEST(Ranger, NothingHitIsExactlyTheMaximumRange) {
  Scene scene("sensor( range [0 7.123456789] samples 181 fov 180 )", "");
  for (const double r : scene.Ranges()) EXPECT_EQ(r, 7.123456789);
  for (const double i : scene.sensor().intensities) EXPECT_EQ(i, 0);
}

// Only changed intensities are written. The result must be correct even if a client has written
// them.
TEST(Ranger, IntensitiesAreCurrent) {
  const char* sensors = "sensor( range [0 9] samples 90 fov 360 ) sensor( samples 7 fov 200 )";
  std::string boxes;
  for (const char* number : {"0", "1", "2", "3"})
    boxes += "model( name \"box" + std::string(number) + "\" size [1 1 1] )\n";
  Scene scene(sensors, boxes), other(sensors, boxes);
  Snapshot snapshot;
  test::RandomSource random(3);
  for (int step = 0; step < 400; step++) {
    const std::string name = "box" + std::to_string(random.Int(0, 3));
    const Pose pose(random.Real(-5, 5), random.Real(-5, 5), 0, random.Real(-3, 3));
    const double seen_as = random.Pick<double>({0, 0.1, 0.5, 1, 1, -1, 1e300});
    const bool pauses = random.OneIn(10);
    for (Scene* each : {&scene, &other}) {
      Find(*each->world, name.c_str())->SetPose(pose);
      Find(*each->world, name.c_str())->SetRangerReturn(seen_as);
      if (pauses) each->ranger->Unsubscribe();
      Step(*each->world);
      if (pauses) each->ranger->Subscribe();
    }
    if (step == 100) {
      ASSERT_TRUE(scene.world->Take(&snapshot));
    }
    if (step % 40 == 39 && step > 100) {
      ASSERT_TRUE(scene.world->Restore(snapshot));
      ASSERT_TRUE(other.world->Restore(snapshot));
    }
    if (pauses) continue;
    for (size_t i = 0; i < 2; i++) {
      std::vector<double>& written = other.sensor(i).intensities;
      ASSERT_EQ(scene.ranger->GetSensors()[i].intensities, written) << step;
      std::fill(written.begin(), written.end(), -5);
    }
  }
}

TEST(Ranger, SeveralSensorsReportOnTheirOwn) {
  Scene scene(
      "sensor( range [0 5] ) sensor( range [0 2] samples 4 fov 0 )"
      "sensor( pose [1 0 0 180] range [0 9] ) sensor( samples 0 )",
      std::string(kBoxAhead) + "model( pose [-4 0 0 0] size [1 1 1] ranger_return 0.25 )");
  Step(*scene.world);
  ASSERT_EQ(scene.ranger->GetSensors().size(), 4u);
  EXPECT_NEAR(scene.sensor(0).ranges.at(0), 2.5, kCell);
  EXPECT_EQ(scene.sensor(1).ranges, (std::vector<double>{2, 2, 2, 2}));
  EXPECT_NEAR(scene.sensor(2).ranges.at(0), 4.5, kCell);
  EXPECT_EQ(scene.sensor(2).intensities.at(0), 0.25);
  EXPECT_TRUE(scene.sensor(3).ranges.empty());
}

TEST(Ranger, RaysStartAtTheSensorInTheBodysFrame) {
  // The ranger is at (0, 1) with heading 90 degrees, its body is moved by (0.2, 0) and turned by
  // -90 degrees, the sensor is moved by (0.1, 0.3) and turned by 90: the ray starts at (0.1, 1.5)
  // along +y.
  Scene scene("sensor( pose [0.1 0.3 0 90] )", "model( pose [0.1 3.5 0 0] size [0.2 1 1] )",
              "pose [0 1 0 90] origin [0.2 0 0 -90]");
  EXPECT_NEAR(scene.Ranges().at(0), 1.5, kCell);
  EXPECT_EQ(scene.sensor().intensities[0], 1);
}

TEST(Ranger, SampleCountAndFieldOfViewCanBeChangedAtRunTime) {
  Scene scene("sensor( samples 1 )");
  EXPECT_EQ(scene.Ranges().size(), 1u);
  for (const unsigned count : {7u, 0u, 1000u, 2u}) {
    scene.sensor().sample_count = count;
    scene.sensor().fov = 0.01;
    Step(*scene.world);
    ASSERT_EQ(scene.sensor().ranges.size(), count);
    ASSERT_EQ(scene.sensor().intensities.size(), count);
    ASSERT_EQ(scene.sensor().bearings.size(), count);
    for (const double r : scene.sensor().ranges) EXPECT_NEAR(r, 2.5, kCell);
    if (count > 1) {
      EXPECT_DOUBLE_EQ(scene.sensor().bearings.back(), 0.005);
    }
  }
  scene.sensor().fov = M_PI;
  Step(*scene.world);
  EXPECT_DOUBLE_EQ(scene.sensor().bearings.back(), M_PI / 2);
  EXPECT_EQ(scene.sensor().ranges.back(), 5);
  scene.sensor().range.max = 2;
  scene.sensor().fov = 0;
  EXPECT_EQ(scene.Ranges(), (std::vector<double>{2, 2}));
}

TEST(Ranger, SensorsCanBeAddedAndRemovedAtRunTime) {
  Scene scene("sensor( )");
  scene.ranger->GetSensorsMutable().push_back(Sensor());
  scene.sensor(1).range.max = 2;
  Step(*scene.world);
  EXPECT_NEAR(scene.sensor(0).ranges.at(0), 2.5, kCell);
  EXPECT_EQ(scene.sensor(1).ranges.at(0), 2);
  scene.ranger->GetSensorsMutable().clear();
  Step(*scene.world);
}

// ---- when ---------------------------------------------------------------------------------------

TEST(Ranger, WithoutSubscribersNothingIsMeasured) {
  const auto world = LoadText("ranger( name \"l\" sensor( samples 3 ) )");
  Step(*world, 3);
  EXPECT_TRUE(Find<ModelRanger>(*world, "l")->GetSensors()[0].ranges.empty());
}

TEST(Ranger, KeepsReadingsAfterTheLastUnsubscription) {
  Scene scene("sensor( )");
  EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
  scene.ranger->Unsubscribe();
  Find(*scene.world, "box")->SetPose(Pose(4, 0, 0, 0));
  Step(*scene.world, 3);
  EXPECT_NEAR(scene.sensor().ranges.at(0), 2.5, kCell);
}

TEST(Ranger, AlwaysonMeasuresFromTheFirstStepOn) {
  const auto world =
      LoadText("ranger( name \"l\" alwayson 1 sensor( ) )\n" + std::string(kBoxAhead));
  EXPECT_TRUE(Find(*world, "l")->HasSubscribers());
  Step(*world);
  EXPECT_NEAR(Find<ModelRanger>(*world, "l")->GetSensors()[0].ranges.at(0), 2.5, kCell);
}

TEST(Ranger, SeesTheWorldAtTheStartOfTheStep) {
  Scene scene("sensor( range [0 9] )",
              "position( name \"r\" pose [4 0 0 180] size [0.4 0.4 1] alwayson 1 )");
  ModelPosition* robot = Find<ModelPosition>(*scene.world, "r");
  robot->SetSpeed(0.8, 0, 0);
  for (int i = 0; i < 20; i++) {
    const double face = robot->GetPose().x - 0.2;
    EXPECT_NEAR(scene.Ranges().at(0), face, 1.001 * kCell);
  }
  EXPECT_NEAR(robot->GetPose().x, 4 - 20 * 0.08, 1e-9);
}

// When a robot stops, Stage 4.3 keeps its last but one image in one of two grids, so that readings
// alternate endlessly: 3.58 3.62 3.58 3.62 ...
TEST(Ranger, StoppedRobotHasConstantRange) {
  Scene scene("sensor( range [0 9] )",
              "position( name \"r\" pose [4.0101 0 0 180] size [0.4 0.4 1] alwayson 1 )");
  ModelPosition* robot = Find<ModelPosition>(*scene.world, "r");
  robot->SetSpeed(0.4, 0, 0);
  const double approach[] = {3.80, 3.76, 3.72, 3.68, 3.64, 3.60};
  for (const double expected : approach) EXPECT_NEAR(scene.Ranges().at(0), expected, kCell);
  robot->Stop();
  Step(*scene.world, 2);
  const double still = scene.Ranges().at(0);
  EXPECT_NEAR(still, robot->GetPose().x - 0.2, kCell);
  for (int i = 0; i < 10; i++) EXPECT_EQ(scene.Ranges().at(0), still);
}

// ---- visibility ---------------------------------------------------------------------------------

TEST(Visibility, IntensityIsTheRangerReturn) {
  for (const double value : {1.0, 0.7, 123.5, 0.0}) {
    Scene scene("sensor( )",
                "model( pose [3 0 0 0] size [1 1 1] ranger_return " + std::to_string(value) + " )");
    EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell) << value;  // 0 also stops the ray
    EXPECT_EQ(scene.sensor().intensities[0], value);
  }
}

TEST(Visibility, NegativeReturnsAreTransparent) {
  Scene scene("sensor( range [0 9] )",
              "model( pose [3 0 0 0] size [1 1 1] ranger_return -1 )\n"
              "model( pose [5 0 0 0] size [1 1 1] ranger_return 0.5 )");
  EXPECT_NEAR(scene.Ranges().at(0), 4.5, kCell);
  EXPECT_EQ(scene.sensor().intensities[0], 0.5);
}

TEST(Visibility, ChangesAtRunTimeInBothDirections) {
  for (const char* loaded_as : {"-1", "1"}) {
    Scene scene("sensor( range [0 9] )",
                "model( name \"box\" pose [3 0 0 0] size [1 1 1] ranger_return " +
                    std::string(loaded_as) + " )");
    Model* box = Find(*scene.world, "box");
    EXPECT_NEAR(scene.Ranges().at(0), loaded_as[0] == '-' ? 9 : 2.5, kCell);
    for (int round = 0; round < 3; round++) {
      box->SetRangerReturn(0.5);
      EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell) << loaded_as << round;
      EXPECT_EQ(scene.sensor().intensities[0], 0.5);
      box->vis.ranger_return = -1;
      EXPECT_EQ(scene.Ranges().at(0), 9) << loaded_as << round;
      box->vis.ranger_return = 0;
      EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell) << loaded_as << round;
      EXPECT_EQ(scene.sensor().intensities[0], 0);
      box->SetRangerReturn(-0.001);
      EXPECT_EQ(scene.Ranges().at(0), 9) << loaded_as << round;
    }
  }
}

TEST(Visibility, ChangesAfterMovingWhileTransparent) {
  Scene scene("sensor( range [0 9] )");
  Model* box = Find(*scene.world, "box");
  box->SetRangerReturn(-1);
  box->SetPose(Pose(4, 0, 0, 0));
  EXPECT_EQ(scene.Ranges().at(0), 9);
  box->SetPose(Pose(5, 0, 0, 0));
  box->SetRangerReturn(1);
  EXPECT_NEAR(scene.Ranges().at(0), 4.5, kCell);
  box->SetRangerReturn(-1);
  Step(*scene.world);
  box->SetRangerReturn(1);
  box->SetPose(Pose(2, 0, 0, 0));
  EXPECT_NEAR(scene.Ranges().at(0), 1.5, kCell);
}

TEST(Visibility, ChangesOfAModelThatDrives) {
  Scene scene("sensor( range [0 9] )",
              "position( name \"r\" pose [3 0 0 0] size [1 1 1] alwayson 1 )");
  ModelPosition* robot = Find<ModelPosition>(*scene.world, "r");
  robot->SetSpeed(0.3, 0, 0);
  EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
  robot->SetRangerReturn(-1);
  for (int i = 0; i < 3; i++) EXPECT_EQ(scene.Ranges().at(0), 9);
  robot->SetRangerReturn(1);
  EXPECT_NEAR(scene.Ranges().at(0), 2.62, kCell);
  EXPECT_NEAR(scene.Ranges().at(0), 2.65, kCell);
}

TEST(Visibility, ChangesOfAModelThatStopped) {
  Scene scene("sensor( range [0 9] )",
              "position( name \"r\" pose [3 0 0 0] size [1 1 1] alwayson 1 ranger_return -1 )");
  ModelPosition* robot = Find<ModelPosition>(*scene.world, "r");
  robot->SetRangerReturn(1);
  EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
  robot->SetRangerReturn(-1);
  robot->SetSpeed(0.3, 0, 0);
  EXPECT_EQ(scene.Ranges().at(0), 9);
  robot->Stop();
  EXPECT_EQ(scene.Ranges().at(0), 9);
  robot->SetRangerReturn(1);
  for (int i = 0; i < 3; i++) EXPECT_NEAR(scene.Ranges().at(0), 2.53, kCell);
}

TEST(Visibility, ChangesOfCarriedModels) {
  Scene scene("sensor( range [0 9] )",
              "model( name \"cart\" pose [3 0 0 0] ranger_return -1 stack_children 0\n"
              "  model( name \"load\" size [1 1 1] ranger_return -1 ) )");
  Model *cart = Find(*scene.world, "cart"), *load = Find(*scene.world, "cart.load");
  EXPECT_EQ(scene.Ranges().at(0), 9);
  load->SetRangerReturn(1);
  EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
  load->SetRangerReturn(-1);
  cart->SetPose(Pose(4, 0, 0, 0));
  EXPECT_EQ(scene.Ranges().at(0), 9);
  load->SetRangerReturn(1);
  EXPECT_NEAR(scene.Ranges().at(0), 3.5, kCell);
}

TEST(Visibility, IgnoresOtherReturns) {
  Scene scene("sensor( )",
              "model( pose [3 0 0 0] size [1 1 1] obstacle_return 0 blob_return 0"
              " color_rgba [0 0 0 0] )");
  EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
}

TEST(Visibility, RayHitsHeightsInAClosedInterval) {
  // A flat sensor, so that the ray is exactly at the height of the ranger.
  struct {
    double z;
    bool hit;
  } const cases[] = {{0.499, false}, {0.5, true}, {1.0, true}, {1.5, true}, {1.501, false}};
  for (const auto& c : cases) {
    Scene scene("sensor( size [0 0 0] )", "model( pose [3 0 0.5 0] size [1 1 1] )",
                "pose [0 0 " + std::to_string(c.z) + " 0]");
    EXPECT_NEAR(scene.Ranges().at(0), c.hit ? 2.5 : 5, kCell) << c.z;
  }
}

TEST(Visibility, RaysLeaveAtHalfTheSensorsHeightOnTopOfTheParent) {
  // The robot is 0.2 high and the ranger is at z = -0.1, so the ray of a default sensor is at 0.11.
  for (const bool hit : {true, false}) {
    const auto world = LoadText(
        "position( size [0.4 0.4 0.2] ranger( name \"l\" pose [0 0 -0.1 0] alwayson 1 sensor( ) ) )"
        "model( pose [3 0 " +
        std::string(hit ? "0.105" : "0.115") + " 0] size [1 1 0.01] )");
    Step(*world);
    EXPECT_NEAR(Find<ModelRanger>(*world, "position:0.l")->GetSensors()[0].ranges.at(0),
                hit ? 2.5 : 5, kCell);
  }
}

TEST(Visibility, HeightsFollowSensorOriginAndStacking) {
  // The height is 0.3 (robot) + 0.5 (pose of shelf) + 0.7 (size of shelf) + 0.05 (ranger) + 0.04
  // (its origin) + 0.1 (sensor) + 0.03 (half its size) = 1.72.
  const std::string tower =
      "position( size [0.1 0.1 0.3] model( pose [0 0 0.5 0] size [0.1 0.1 0.7] ranger( name \"/l\""
      " pose [0 0 0.05 0] origin [0 0 0.04 0] alwayson 1 sensor( pose [0 0 0.1 0]"
      " size [0.1 0.1 0.06] ) ) ) )\n";
  for (const double bottom : {1.715, 1.725}) {
    const auto world =
        LoadText(tower + "model( pose [3 0 " + std::to_string(bottom) + " 0] size [1 1 0.01] )");
    Step(*world);
    EXPECT_NEAR(Find<ModelRanger>(*world, "l")->GetSensors()[0].ranges.at(0),
                bottom < 1.72 ? 2.5 : 5, kCell);
  }
}

TEST(Visibility, OwnTreeIsTransparent) {
  const auto world = LoadText(
      "position( name \"r\" size [2 2 1] stack_children 0\n"
      "  model( pose [0.5 0 0 0] size [0.1 0.3 1] model( pose [0.2 0 -0.7 0] size [0.1 0.3 1] ) )\n"
      "  ranger( name \"l\" pose [0 0 0.3 0] block( points 3 point[0] [0 0] point[1] [1 0]"
      " point[2] [0 1] z [0 1] ) alwayson 1 sensor( range [0 9] samples 8 fov 315 ) ) )\n" +
      std::string(kBoxAhead));
  Step(*world);
  const Sensor& s = Find<ModelRanger>(*world, "r.l")->GetSensors()[0];
  for (size_t i = 0; i < 8; i++) EXPECT_EQ(s.ranges[i], 9) << i;
  Find(*world, "box")
      ->SetPose(Pose(3 * std::cos(s.bearings[5]), 3 * std::sin(s.bearings[5]), 0, s.bearings[5]));
  Step(*world);
  EXPECT_NEAR(s.ranges[5], 2.5, 2 * kCell);
}

TEST(Visibility, PickedUpModelsBecomeTransparent) {
  const auto world = LoadText(
      "position( name \"r\" size [0.2 0.2 0.2] ranger( name \"l\" alwayson 1"
      " sensor( range [0 9] ) ) )\n" +
      std::string(kBoxAhead));
  Model *robot = Find(*world, "r"), *box = Find(*world, "box");
  const std::vector<double>& ranges = Find<ModelRanger>(*world, "r.l")->GetSensors()[0].ranges;
  Step(*world);
  EXPECT_NEAR(ranges.at(0), 2.5, kCell);
  box->SetParent(robot);
  Step(*world);
  EXPECT_EQ(ranges.at(0), 9);
  box->SetParent(nullptr);
  Step(*world);
  EXPECT_NEAR(ranges.at(0), 2.5, kCell);
}

// ---- edge cases ---------------------------------------------------------------------------------

TEST(EdgeCases, NoSamples) {
  Scene scene("sensor( samples 0 )");
  Step(*scene.world, 2);
  EXPECT_TRUE(scene.sensor().ranges.empty());
  EXPECT_TRUE(scene.sensor().intensities.empty());
  EXPECT_TRUE(scene.sensor().bearings.empty());
}

TEST(EdgeCases, OneSampleLooksAheadWhateverTheFieldOfView) {
  for (const char* fov : {"0", "90", "360", "-720"}) {
    Scene scene("sensor( samples 1 fov " + std::string(fov) + " )");
    EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
    EXPECT_EQ(scene.sensor().bearings.at(0), 0);
  }
}

TEST(EdgeCases, MaximumRangeZero) {
  Scene scene("sensor( range [0 0] samples 5 )", "model( size [0.1 0.1 1] )");
  EXPECT_EQ(scene.Ranges(), std::vector<double>(5, 0));
  EXPECT_EQ(scene.sensor().intensities, std::vector<double>(5, 0));
}

TEST(EdgeCases, UnusableMaximumRangesCountAsZero) {
  for (const double range : {-3.0, kNaN}) {
    Scene scene("sensor( samples 2 )");
    scene.sensor().range.max = range;
    EXPECT_EQ(scene.Ranges(), std::vector<double>(2, 0)) << range;
    EXPECT_EQ(scene.sensor().intensities, std::vector<double>(2, 0));
  }
}

TEST(EdgeCases, ARangeBelowACellIsARangeLikeAnyOther) {
  Scene scene("sensor( range [0 0.01] )");
  EXPECT_EQ(scene.Ranges().at(0), 0.01);
  Scene close("sensor( range [0 0.01] )", kBoxAhead, "pose [2.495 0 0 0]");
  EXPECT_LE(close.Ranges().at(0), 0.01);
  EXPECT_EQ(close.sensor().intensities.at(0), 1);
}

TEST(EdgeCases, TheMinimumRangeHasNoEffect) {
  Scene nearer("sensor( range [4 8] )");
  EXPECT_NEAR(nearer.Ranges().at(0), 2.5, kCell);
  Scene beyond("sensor( range [2 2] )");
  EXPECT_EQ(beyond.Ranges().at(0), 2);
}

TEST(EdgeCases, FieldsOfView) {
  struct {
    const char* fov;
    std::vector<double> bearings;
  } const cases[] = {{"0", {0, 0, 0}},
                     {"360", {-M_PI, -M_PI / 2, 0, M_PI / 2, M_PI}},
                     {"720", {-2 * M_PI, 0, 2 * M_PI}},
                     {"-90", {M_PI / 4, 0, -M_PI / 4}}};
  for (const auto& c : cases) {
    Scene scene("sensor( fov " + std::string(c.fov) + " samples " +
                std::to_string(c.bearings.size()) + " )");
    Step(*scene.world);
    const Sensor& s = scene.sensor();
    ASSERT_EQ(s.bearings.size(), c.bearings.size()) << c.fov;
    for (size_t i = 0; i < c.bearings.size(); i++) {
      EXPECT_NEAR(s.bearings[i], c.bearings[i], 1e-12) << c.fov;
      const bool ahead = std::fabs(normalize(c.bearings[i])) < 1e-9;
      EXPECT_NEAR(s.ranges[i], ahead ? 2.5 : 5, kCell) << c.fov << " " << i;
    }
  }
}

TEST(EdgeCases, NonFiniteFieldsOfViewLookAhead) {
  for (const double fov : {kNaN, kInfinity}) {
    Scene scene("sensor( samples 3 )");
    scene.sensor().fov = fov;
    for (const double r : scene.Ranges()) EXPECT_NEAR(r, 2.5, kCell) << fov;
    EXPECT_EQ(scene.sensor().bearings, std::vector<double>(3, 0));
  }
}

TEST(EdgeCases, HugeAndInfiniteRanges) {
  for (const double range : {1e6, 5e7, 1e12, 1e300, kInfinity}) {
    Scene scene("sensor( samples 2 fov 180 )");
    scene.sensor().range.max = range;
    EXPECT_EQ(scene.Ranges().at(0), range);
    scene.sensor().fov = 0;
    EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell) << range;
  }
}

TEST(EdgeCases, AnInfiniteRangeInAWorldFile) {
  Scene scene("sensor( range [0 \"inf\"] samples 3 fov 180 noise [0.01 0.1 0] )");
  const std::vector<double>& ranges = scene.Ranges();
  EXPECT_EQ(ranges[0], kInfinity);
  EXPECT_LT(ranges[1], 5);
  EXPECT_EQ(scene.sensor().intensities, (std::vector<double>{0, 1, 0}));
}

TEST(EdgeCases, NonFinitePosesSeeNothing) {
  const Pose poses[] = {Pose(kNaN, 0, 0, 0),      Pose(0, kNaN, 0, 0),      Pose(0, 0, 0, kNaN),
                        Pose(kInfinity, 0, 0, 0), Pose(0, 0, 0, kInfinity), Pose(1e12, 0, 0, 0),
                        Pose(0, 0, kInfinity, 0)};
  for (const Pose& pose : poses) {
    Scene scene("sensor( samples 3 fov 0 )");
    scene.sensor().pose = pose;
    EXPECT_EQ(scene.Ranges(), std::vector<double>(3, 5)) << pose.String();
    EXPECT_EQ(scene.sensor().intensities, std::vector<double>(3, 0)) << pose.String();
    scene.sensor().pose = Pose();
    EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
  }
}

// In Stage 4.3 a ray at height NaN passes every test of heights.
TEST(EdgeCases, SensorAtHeightNaNSeesNothing) {
  Scene scene("sensor( )");
  scene.sensor().pose.z = kNaN;
  EXPECT_EQ(scene.Ranges().at(0), 5);
  EXPECT_EQ(scene.sensor().intensities.at(0), 0);
}

TEST(EdgeCases, HugeHeadingsDoNotHang) {
  Scene scene("sensor( )");
  scene.sensor().pose.a = 1e17;
  Step(*scene.world);
  scene.sensor().pose.a = 200 * M_PI;
  EXPECT_NEAR(scene.Ranges().at(0), 2.5, kCell);
}

TEST(EdgeCases, WorldFilesAreRefused) {
  for (const char* property :
       {"samples -1", "samples 4294967295", "range [0 -3]", "range [0 \"nan\"]",
        "range [\"inf\" 5]", "range [0 \"-inf\"]", "fov \"nan\"", "pose [0 0 \"nan\" 0]",
        "pose [0 0 0 \"inf\"]", "noise [-0.1 0 0]", "noise [0.1]", "range 5", "pose [0 0 0]"}) {
    const LoadOutcome outcome = TryToLoad("ranger( sensor( " + std::string(property) + " ) )");
    EXPECT_FALSE(outcome.loaded) << property;
    EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << property << ": " << outcome.errors;
    EXPECT_EQ(outcome.models, 1u);
  }
}

}  // namespace
}  // namespace Stg
