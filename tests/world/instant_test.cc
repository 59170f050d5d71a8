// SPDX-License-Identifier: GPL-2.0-or-later
//
// The scan, the estimate and the true pose with the same time stamp belong to the same instant, for
// any step length, update interval, localization and time of subscription.

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "support/mapper.hh"
#include "support/model_testing.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

constexpr double kClose = 1e-9;  // metres; the estimate of another step is off by centimetres

/// Collects the scans of a ranger in its update callbacks, as a controller does.
struct Controller {
  ModelPosition* robot;
  ModelRanger* ranger;
  Mapper believed, true_places, scan_places;

  static int OnUpdate(Model* mod, void* self) {
    static_cast<Controller*>(self)->Take(mod->GetWorld()->SimTimeNow());
    return 0;
  }
  void Take(usec_t now) {
    EXPECT_EQ(robot->GetSensedTime(), now);
    EXPECT_EQ(ranger->GetLastUpdate(), now);
    const bool gps = robot->GetLocalizationMode() == ModelPosition::LOCALIZATION_GPS;
    Map(gps ? robot->est_pose : robot->est_origin + robot->est_pose, &believed);
    Map(robot->GetSensedPose(), &true_places);
  }
  void Map(const Pose& place, Mapper* map) const {
    MapFrom(ranger->SensorFrame(place + ranger->GetSensedLocalPose()), map);
  }
  /// Takes the readings as pictures show them, at any time.
  void Look() { MapFrom(ranger->SensorFrame(ranger->GetScanPose()), &scan_places); }
  void MapFrom(const Pose& frame, Mapper* map) const {
    for (const ModelRanger::Sensor& sensor : ranger->GetSensors())
      for (size_t i = 0; i < sensor.ranges.size(); i++)
        map->Add(ModelRanger::OriginOf(sensor, frame, SinCos(frame.a)), sensor.bearings[i],
                 sensor.ranges[i]);
  }
};

struct Case {
  int step, ranger_interval, robot_interval;
  const char* localization;
  int late;  // number of steps before the ranger gets a subscriber
};

std::vector<Case> Cases() {
  std::vector<Case> cases;
  for (const char* localization : {"gps", "odom"})
    for (const int step : {5, 20, 100})
      for (const auto& [ranger, robot] :
           {std::pair(100, 100), {step, 100}, {100, step}, {30, 70}, {250, 100}})
        for (const int late : {0, 7}) cases.push_back({step, ranger, robot, localization, late});
  return cases;
}

std::string TextOf(const Case& c) {
  return "interval_sim " + std::to_string(c.step) + "\n" +
         Room("position( name \"r\" size [0.4 0.4 0.4] pose [1 -2 0 30] localization \"" +
              std::string(c.localization) + "\" odom_error [0 0 0 0] update_interval " +
              std::to_string(c.robot_interval) +
              " ranger( name \"l\" pose [0.05 0.02 0 5] update_interval " +
              std::to_string(c.ranger_interval) +
              " sensor( pose [0.05 0 0 10] range [0 20] fov 350 samples 36 ) ) )");
}

TEST(OneInstant, MapperInACallbackFindsTheWalls) {
  for (const Case& c : Cases()) {
    const auto world = LoadText(TextOf(c));
    Controller controller{
        FindRunning<ModelPosition>(*world, "r"), Find<ModelRanger>(*world, "r.l"), {}, {}, {}};
    controller.ranger->AddCallback(Model::CB_UPDATE, Controller::OnUpdate, &controller);
    controller.robot->SetSpeed(0.5, 0, 1.2);
    Step(*world, c.late);
    controller.ranger->Subscribe();
    for (int i = 0; i < (kSanitized ? 2000 : 12000) / c.step; i++) {
      Step(*world);
      controller.Look();
    }

    std::string what = std::string(c.localization) + ", steps of " + std::to_string(c.step) +
                       " ms, updates " + std::to_string(c.ranger_interval) + " and " +
                       std::to_string(c.robot_interval) + " ms, late " + std::to_string(c.late);
    controller.believed.Print(what);
    EXPECT_GT(controller.believed.points(), 200u) << what;
    EXPECT_LT(controller.believed.Quantile(1), kClose) << what;
    EXPECT_LT(controller.true_places.Quantile(1), kClose) << what;
    EXPECT_LT(controller.scan_places.Quantile(1), kClose) << what;
  }
}

// Readings belong to the pose before the controller moved the robot.
TEST(OneInstant, HoldsForARobotThatAControllerMovesByHand) {
  const auto world = LoadText(
      Room("position( name \"r\" alwayson 1 ranger( name \"l\" alwayson 1 sensor( range [0 20]"
           " fov 350 samples 36 ) ) )"));
  Controller controller{
      FindRunning<ModelPosition>(*world, "r"), FindRunning<ModelRanger>(*world, "r.l"), {}, {}, {}};
  controller.ranger->AddCallback(Model::CB_UPDATE, Controller::OnUpdate, &controller);
  const auto jump = [](Model* mod, void*) {
    const double turn = static_cast<double>(mod->GetWorld()->GetUpdateCount());
    mod->SetPose(Pose(3 * std::cos(turn), 3 * std::sin(turn), 0, turn));
    return 0;
  };
  controller.robot->AddCallback(Model::CB_UPDATE, jump, nullptr);
  Step(*world, 50);
  EXPECT_LT(controller.believed.Quantile(1), kClose);
  EXPECT_LT(controller.true_places.Quantile(1), kClose);
}

// Robots and sensors that other models carry have the poses of the same instant.
TEST(OneInstant, HoldsForSensorsOnActuatorsAndForRobotsOnRobots) {
  const auto world = LoadText(
      "interval_sim 20\n" +
      Room("position( name \"r\" pose [0 1 0 0] actuator( name \"a\" type \"rotational\""
           " max_speed 2 min_position -100 max_position 100 position( name \"n\" ranger( name \"l\""
           " sensor( range [0 20] fov 350 samples 36 ) ) ) ) )"));
  auto* const robot = FindRunning<ModelPosition>(*world, "r");
  auto* const arm = FindRunning<ModelActuator>(*world, "r.a");
  auto* const nested = FindRunning<ModelPosition>(*world, "r.a.n");
  auto* const ranger = FindRunning<ModelRanger>(*world, "r.a.n.l");
  robot->SetSpeed(0.5, 0, 0.7);
  arm->SetSpeed(1.1);
  nested->SetSpeed(0.1, 0, 0.9);
  Mapper chain, by_ranger, by_robot;
  for (int i = 0; i < 400; i++) {
    Step(*world);
    if (ranger->GetLastUpdate() != world->SimTimeNow()) continue;
    const auto map = [&](const Pose& place, Mapper* to) {
      const ModelRanger::Sensor& sensor = ranger->GetSensors()[0];
      const Pose frame = ranger->SensorFrame(place);
      for (size_t k = 0; k < sensor.ranges.size(); k++)
        to->Add(ModelRanger::OriginOf(sensor, frame, SinCos(frame.a)), sensor.bearings[k],
                sensor.ranges[k]);
    };
    map(ranger->GetSensedPose(), &by_ranger);
    map(nested->est_pose + ranger->GetSensedLocalPose(), &by_robot);
    map(robot->GetSensedPose() + arm->GetSensedLocalPose() + nested->GetSensedLocalPose() +
            ranger->GetSensedLocalPose(),
        &chain);
  }
  for (Mapper* mapper : {&chain, &by_ranger, &by_robot}) {
    EXPECT_GT(mapper->points(), 2000u);
    EXPECT_LT(mapper->Quantile(1), kClose);
  }
}

/// Everything that a world reports about one instant.
std::vector<double> AllOf(World& world) {
  std::vector<double> all;
  for (const Model* model : world.engine().models) {
    const Pose sensed = model->GetSensedPose();
    if (const auto* ranger = dynamic_cast<const ModelRanger*>(model)) {
      const Pose scan = ranger->GetScanPose();
      all.insert(all.end(), {scan.x, scan.y, scan.z, scan.a});
    }
    all.insert(all.end(), {sensed.x, sensed.y, sensed.z, sensed.a,
                           static_cast<double>(model->GetLastUpdate())});
    if (const auto* robot = dynamic_cast<const ModelPosition*>(model)) {
      const Pose& e = robot->est_pose;
      all.insert(all.end(), {e.x, e.y, e.a, static_cast<double>(robot->GetSensedTime())});
    }
    if (const auto* ranger = dynamic_cast<const ModelRanger*>(model))
      for (const ModelRanger::Sensor& sensor : ranger->GetSensors())
        all.insert(all.end(), sensor.ranges.begin(), sensor.ranges.end());
  }
  return all;
}

TEST(OneInstant, IsThatOfASnapshotAfterARestore) {
  for (const Case& c : Cases()) {
    const auto world = LoadText(TextOf(c));
    auto* const robot = FindRunning<ModelPosition>(*world, "r");
    FindRunning<ModelRanger>(*world, "r.l");
    robot->SetSpeed(0.5, 0, 1.2);
    Step(*world, 11);
    const std::vector<double> then = AllOf(*world);
    Snapshot snapshot;
    ASSERT_TRUE(world->Take(&snapshot));
    Step(*world, 9);
    const std::vector<double> later = AllOf(*world);
    ASSERT_TRUE(world->Restore(snapshot));
    EXPECT_EQ(AllOf(*world), then);
    Step(*world, 9);
    EXPECT_EQ(AllOf(*world), later);
  }
}

TEST(OneInstant, IsTheSameOnAnyNumberOfThreads) {
  std::string text = Room("");
  for (int i = 0; i < 1200; i++)
    text += "position( name \"r" + std::to_string(i) + "\" pose [" +
            std::to_string(i % 40 * 0.2 - 4) + " " + std::to_string(i / 40 * 0.2 - 4) +
            " 0 0] size [0.1 0.1 0.1] obstacle_return 0"
            " velocity [0.1 0 0 20] localization \"odom\" alwayson 1 update_interval " +
            std::to_string(100 + 100 * (i % 3)) +
            " ranger( update_interval 200 alwayson 1 sensor( samples 2 fov 90 range [0 20] ) ) )\n";
  std::vector<double> first;
  for (const int threads : {1, 2, 3}) {
    RunOptions options;
    options.threads = threads;
    options.share_from = 1;
    InitLibrary();
    World world(options);
    std::istringstream content(text);
    ASSERT_TRUE(world.Load(content, "t.world"));
    Step(world, 7);
    if (threads == 1)
      first = AllOf(world);
    else
      EXPECT_EQ(AllOf(world), first) << threads;
  }
}

}  // namespace
}  // namespace Stg
