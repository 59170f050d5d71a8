// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tests NaN and infinity in all numeric arguments of the interface and in all numbers that clients
// may write: which are refused, which are replaced, and that the world continues. It verifies rows
// of docs/extremes.md.

#include <functional>

#include "extremes_testing.hh"
#include "support/all_models.hh"

namespace Stg::extremes {
namespace {

/// A world with a model of each type.
struct Things {
  Things()
      : world(
            LoadText("define eyes ranger( name \"eye\" sensor( range [0 6] fov 180 samples 19 ) )\n"
                     "define robot position( size [0.4 0.4 0.3] joules 1000 drive \"omni\" mass 3\n"
                     "  localization \"odom\" odom_error [0 0 0 0]\n"
                     "  eyes() blobfinder( name \"blobs\" ) fiducial( name \"finder\" )\n"
                     "  bumper( name \"bumper\" bcount 1 bpose[0] [0.2 0 0 0] blength 0.4 )\n"
                     "  camera( name \"camera\" ) gripper( name \"gripper\" )\n"
                     "  actuator( name \"arm\" size [0.1 0.1 0.1] max_speed 1 )\n"
                     "  wifi( name \"wifi\" model \"raytrace\" power 100 range 5 )\n"
                     "  radio( name \"radio\" range 9 line_of_sight 1 ) )\n"
                     "robot( name \"a\" pose [-2 0 0 0] fiducial_return 1 )\n"
                     "robot( name \"b\" pose [2 0.1 0 180] fiducial_return 2 )\n"
                     "model( name \"wall\" pose [0 3 0 0] size [8 0.2 1] )\n")),
        robot(Find<ModelPosition>(*world, "a")),
        wall(Find(*world, "wall")) {
    for (Model* model : all_models::ByNumber(world.get())) model->Subscribe();
  }
  template <class M>
  M* Part(const char* name) {
    return Find<M>(*world, std::string("a.") + name);
  }
  ModelRanger::Sensor& sensor() { return Part<ModelRanger>("eye")->GetSensorsMutable()[0]; }

  std::unique_ptr<World> world;
  ModelPosition* robot;
  Model* wall;
};

/// Data of a model that the state hash does not cover.
std::vector<double> Remainder(const Model& model) {
  const Geom g = model.GetGeom();
  return {g.pose.x,
          g.pose.y,
          g.pose.z,
          g.pose.a,
          g.size.x,
          g.size.y,
          g.size.z,
          model.GetTotalMass(),
          model.vis.ranger_return};
}

struct Call {
  const char* name;
  std::function<void(Things&, double)> make;
};

void PrintTo(const Call& call, std::ostream* out) { *out << call.name; }

class Refused : public testing::TestWithParam<Call> {};
class NotANumber : public testing::TestWithParam<Call> {};

/// Expects that the call prints one message and changes nothing.
void ExpectRefusal(const Call& call, double value) {
  Things things;
  Step(*things.world, 2);
  const uint64_t before = things.world->StateHash();
  const std::vector<double> wall = Remainder(*things.wall), robot = Remainder(*things.robot);
  const std::string errors = ErrorsOf([&] { call.make(things, value); });
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  EXPECT_EQ(things.world->StateHash(), before) << value;
  EXPECT_EQ(Remainder(*things.wall), wall);
  EXPECT_EQ(Remainder(*things.robot), robot);

  // Afterwards, the world evolves as without the call.
  Things untouched;
  Step(*untouched.world, 12);
  Step(*things.world, 10);
  EXPECT_EQ(things.world->StateHash(), untouched.world->StateHash()) << value;
}

TEST_P(Refused, NonFiniteArguments) {
  for (const double value : {kNaN, kInfinity, -kInfinity}) ExpectRefusal(GetParam(), value);
}

TEST_P(NotANumber, IsRefused) { ExpectRefusal(GetParam(), kNaN); }

std::string NameOf(const testing::TestParamInfo<Call>& test) { return test.param.name; }

ModelGripper::config_t ConfigWith(Things& t, double ModelGripper::config_t::*number, double value) {
  ModelGripper::config_t config = t.Part<ModelGripper>("gripper")->GetConfig();
  config.*number = value;
  return config;
}

void SetConfig(Things& t, ModelGripper::config_t config) {
  t.Part<ModelGripper>("gripper")->SetConfig(config);
}

const Call kRejected[] = {
    {"SetPoseX", [](Things& t, double v) { t.wall->SetPose(Pose(v, 0, 0, 0)); }},
    {"SetPoseY", [](Things& t, double v) { t.wall->SetPose(Pose(0, v, 0, 0)); }},
    {"SetPoseZ", [](Things& t, double v) { t.wall->SetPose(Pose(0, 0, v, 0)); }},
    {"SetPoseA", [](Things& t, double v) { t.wall->SetPose(Pose(0, 0, 0, v)); }},
    {"SetGlobalPose", [](Things& t, double v) { t.wall->SetGlobalPose(Pose(v, 0, 0, 0)); }},
    {"SetGlobalPoseOfAChild",
     [](Things& t, double v) { t.Part<Model>("eye")->SetGlobalPose(Pose(0, v, 0, 0)); }},
    {"AddToPose", [](Things& t, double v) { t.wall->AddToPose(0, 0, 0, v); }},
    {"AddToPoseOfAPose", [](Things& t, double v) { t.wall->AddToPose(Pose(0, v, 0, 0)); }},
    {"SetGeomPose",
     [](Things& t, double v) { t.wall->SetGeom(Geom(Pose(v, 0, 0, 0), Size(1, 1, 1))); }},
    {"SetGeomSizeX", [](Things& t, double v) { t.wall->SetGeom(Geom(Pose(), Size(v, 1, 1))); }},
    {"SetGeomSizeZ", [](Things& t, double v) { t.wall->SetGeom(Geom(Pose(), Size(1, 1, v))); }},
    {"AddBlockRectX", [](Things& t, double v) { t.wall->AddBlockRect(v, 0, 1, 1, 1); }},
    {"AddBlockRectDY", [](Things& t, double v) { t.wall->AddBlockRect(0, 0, 1, v, 1); }},
    {"AddBlockRectDZ", [](Things& t, double v) { t.wall->AddBlockRect(0, 0, 1, 1, v); }},
    {"RandomPoseInFreeSpace",
     [](Things& t, double v) { EXPECT_FALSE(t.wall->RandomPoseInFreeSpace(0, v, 0, 1)); }},
    {"SetMass", [](Things& t, double v) { t.robot->SetMass(v); }},
    {"SetWatts", [](Things& t, double v) { t.wall->SetWatts(v); }},
    {"SetRangerReturn", [](Things& t, double v) { t.wall->SetRangerReturn(v); }},
    {"GoTo", [](Things& t, double v) { t.robot->GoTo(v, 0, 0); }},
    {"GoToAPose", [](Things& t, double v) { t.robot->GoTo(Pose(0, 0, 0, v)); }},
    {"SetOdom", [](Things& t, double v) { t.robot->SetOdom(Pose(0, v, 0, 0)); }},
    {"GripperPaddles",
     [](Things& t, double v) {
       SetConfig(t, ConfigWith(t, &ModelGripper::config_t::paddle_position, v));
     }},
    {"GripperLift",
     [](Things& t, double v) {
       SetConfig(t, ConfigWith(t, &ModelGripper::config_t::lift_position, v));
     }},
    {"GripperLimit",
     [](Things& t, double v) {
       SetConfig(t, ConfigWith(t, &ModelGripper::config_t::close_limit, v));
     }},
    {"GripperSize",
     [](Things& t, double v) {
       ModelGripper::config_t config = t.Part<ModelGripper>("gripper")->GetConfig();
       config.paddle_size.y = v;
       SetConfig(t, config);
     }},
};
INSTANTIATE_TEST_SUITE_P(Api, Refused, testing::ValuesIn(kRejected), NameOf);

/// Calls that refuse NaN, but accept infinity: see the tests Infinity below.
const Call kNotANumber[] = {
    {"SetSpeed", [](Things& t, double v) { t.robot->SetSpeed(v, 0, 0); }},
    {"SetSpeedOfAVelocity", [](Things& t, double v) { t.robot->SetSpeed(Velocity(0, 0, v, 0)); }},
    {"SetXSpeed", [](Things& t, double v) { t.robot->SetXSpeed(v); }},
    {"SetYSpeed", [](Things& t, double v) { t.robot->SetYSpeed(v); }},
    {"SetZSpeed", [](Things& t, double v) { t.robot->SetZSpeed(v); }},
    {"SetTurnSpeed", [](Things& t, double v) { t.robot->SetTurnSpeed(v); }},
    {"SetAcceleration", [](Things& t, double v) { t.robot->SetAcceleration(0, v, 0); }},
    {"SetVelocity", [](Things& t, double v) { t.robot->SetVelocity(Velocity(0, 0, 0, v)); }},
    {"SetGlobalVelocity",
     [](Things& t, double v) { t.robot->SetGlobalVelocity(Velocity(v, 0, 0, 0)); }},
    {"ActuatorSpeed", [](Things& t, double v) { t.Part<ModelActuator>("arm")->SetSpeed(v); }},
    {"ActuatorGoTo", [](Things& t, double v) { t.Part<ModelActuator>("arm")->GoTo(v); }},
    {"StoredEnergy", [](Things& t, double v) { t.robot->FindPowerPack()->SetStored(v); }},
    {"CapacityForEnergy", [](Things& t, double v) { t.robot->FindPowerPack()->SetCapacity(v); }},
};
INSTANTIATE_TEST_SUITE_P(Api, NotANumber, testing::ValuesIn(kNotANumber), NameOf);

// ---- infinite arguments -------------------------------------------------------------------------

TEST(Infinity, CommandsAreClippedToTheBounds) {
  Things things;
  things.robot->SetSpeed(kInfinity, -kInfinity, kInfinity);
  things.Part<ModelActuator>("arm")->SetSpeed(kInfinity);
  Step(*things.world);
  ExpectPose(things.robot->GetVelocity(), 1, -1, 0, M_PI / 2);
  EXPECT_NEAR(things.Part<ModelActuator>("arm")->GetPosition(), 0.1, 1e-9);
  EXPECT_TRUE(std::isfinite(things.robot->FindPowerPack()->GetStored()));
  EXPECT_GT(things.robot->FindPowerPack()->GetStored(), 900) << "only actual motion costs energy";
}

TEST(Infinity, AccelerationsAreClippedToTheBounds) {
  Things things;
  things.robot->SetAcceleration(kInfinity, -kInfinity, 0);
  Step(*things.world, 2);
  ExpectPose(things.robot->GetVelocity(), 0.2, -0.2, 0, 0);
}

TEST(Infinity, CommandsWithoutBoundsStall) {
  Things things;
  ModelPosition& robot = *things.robot;
  const auto expect_stall = [&](const std::function<void()>& command) {
    command();
    Step(*things.world, 3);
    ExpectPose(robot.GetPose(), -2, 0, 0, 0, 0);
    EXPECT_TRUE(robot.Stalled());
    EXPECT_TRUE(IsFinite(robot.est_pose));
    EXPECT_TRUE(std::isfinite(robot.FindPowerPack()->GetStored()));
    robot.SetStall(false);
  };
  for (Bounds& bounds : robot.velocity_bounds) bounds = Bounds(-kInfinity, kInfinity);
  expect_stall([&] { robot.SetSpeed(kInfinity, 0, 0); });
  expect_stall([&] { robot.SetSpeed(0, 0, -kInfinity); });
  robot.Stop();
  Step(*things.world);
  things.world->sim_interval = 1000;  // so that a velocity stays set between two updates
  expect_stall([&] { robot.SetVelocity(Velocity(0, kInfinity, 0, 0)); });
  things.world->sim_interval = 100000;
  robot.SetSpeed(0.5, 0, 0);
  Step(*things.world);
  EXPECT_NEAR(robot.GetPose().x, -1.95, 1e-9);
}

// ---- public members -----------------------------------------------------------------------------

/// Public fields. After each is set to a value, the world runs for some steps with finite results.
const Call kFields[] = {
    {"SensorX", [](Things& t, double v) { t.sensor().pose.x = v; }},
    {"SensorZ", [](Things& t, double v) { t.sensor().pose.z = v; }},
    {"SensorHeading", [](Things& t, double v) { t.sensor().pose.a = v; }},
    {"SensorHeight", [](Things& t, double v) { t.sensor().size.z = v; }},
    {"SensorRangeMin", [](Things& t, double v) { t.sensor().range.min = v; }},
    {"SensorFov", [](Things& t, double v) { t.sensor().fov = v; }},
    {"SensorNoise", [](Things& t, double v) { t.sensor().range_noise = v; }},
    {"SensorVariance", [](Things& t, double v) { t.sensor().range_noise_const = v; }},
    {"SensorAngleNoise", [](Things& t, double v) { t.sensor().angle_noise = v; }},
    {"BlobfinderFov", [](Things& t, double v) { t.Part<ModelBlobfinder>("blobs")->fov = v; }},
    {"BlobfinderPan", [](Things& t, double v) { t.Part<ModelBlobfinder>("blobs")->pan = v; }},
    {"BlobfinderRange", [](Things& t, double v) { t.Part<ModelBlobfinder>("blobs")->range = v; }},
    {"FiducialRange",
     [](Things& t, double v) { t.Part<ModelFiducial>("finder")->max_range_anon = v; }},
    {"FiducialIdRange",
     [](Things& t, double v) { t.Part<ModelFiducial>("finder")->max_range_id = v; }},
    {"FiducialFov", [](Things& t, double v) { t.Part<ModelFiducial>("finder")->fov = v; }},
    {"BumperLength",
     [](Things& t, double v) { t.Part<ModelBumper>("bumper")->bumpers[0].length = v; }},
    {"BumperPose",
     [](Things& t, double v) { t.Part<ModelBumper>("bumper")->bumpers[0].pose.a = v; }},
    {"CameraPitch", [](Things& t, double v) { t.Part<ModelCamera>("camera")->setPitch(v); }},
    {"CameraYaw", [](Things& t, double v) { t.Part<ModelCamera>("camera")->setYaw(v); }},
    {"WifiPower", [](Things& t, double v) { t.Part<ModelWifi>("wifi")->power = v; }},
    {"WifiSensitivity", [](Things& t, double v) { t.Part<ModelWifi>("wifi")->sensitivity = v; }},
    {"WifiFrequency", [](Things& t, double v) { t.Part<ModelWifi>("wifi")->freq = v; }},
    {"WifiLoss", [](Things& t, double v) { t.Part<ModelWifi>("wifi")->plc = v; }},
    {"WifiWalls", [](Things& t, double v) { t.Part<ModelWifi>("wifi")->wall_factor = v; }},
    {"RadioRange", [](Things& t, double v) { t.Part<ModelRadio>("radio")->range = v; }},
    {"RadioLoss", [](Things& t, double v) { t.Part<ModelRadio>("radio")->loss = v; }},
    {"RadioRangeNoise", [](Things& t, double v) { t.Part<ModelRadio>("radio")->range_noise = v; }},
    {"RadioBearingNoise",
     [](Things& t, double v) { t.Part<ModelRadio>("radio")->bearing_noise = v; }},
    {"VelocityBounds",
     [](Things& t, double v) {
       t.robot->velocity_bounds[0] = Bounds(v, v);
       t.robot->SetSpeed(0.1, 0, 0.1);
     }},
    {"AccelerationBounds",
     [](Things& t, double v) {
       t.robot->acceleration_bounds[0] = Bounds(v, v);
       t.robot->SetAcceleration(0.1, 0, 0.1);
     }},
    {"Waypoints",
     [](Things& t, double v) { t.robot->waypoints.emplace_back(v, v, v, v, Color()); }},
    {"Color", [](Things& t, double v) { t.wall->SetColor(Color(v, v, v, v)); }},
    {"Friction", [](Things& t, double v) { t.wall->SetFriction(v); }},
    {"MapResolution", [](Things& t, double v) { t.wall->SetMapResolution(v); }},
    {"Flag",
     [](Things& t, double v) {
       static Model::Flag flag(Color(), 1);
       flag.SetSize(v);
       t.wall->AddFlag(&flag);
     }},
    {"Speedup", [](Things& t, double v) { t.world->speedup = v; }},
};

class Fields : public testing::TestWithParam<Call> {};

size_t ExpectNumbers(Things& t) {
  size_t count = 0;
  const auto expect = [&](double value) {
    EXPECT_TRUE(std::isfinite(value));
    count++;
  };
  for (const Model* model : t.world->GetAllModels())
    EXPECT_TRUE(IsFinite(model->GetGlobalPose())) << model->PrintWithPose();
  EXPECT_TRUE(IsFinite(t.robot->est_pose));
  expect(t.robot->FindPowerPack()->GetStored());
  expect(t.robot->FindPowerPack()->GetDissipated());
  for (const auto* data : {&t.sensor().ranges, &t.sensor().intensities, &t.sensor().bearings})
    for (const double value : *data) expect(value);
  for (const auto& blob : t.Part<ModelBlobfinder>("blobs")->GetBlobs()) expect(blob.range);
  for (const auto& found : t.Part<ModelFiducial>("finder")->GetFiducials()) {
    expect(found.range);
    expect(found.bearing);
  }
  for (const auto& heard : t.Part<ModelWifi>("wifi")->GetNeighbors()) expect(heard.db);
  for (const auto& message : t.Part<ModelRadio>("radio")->Received()) {
    expect(message.range);
    expect(message.bearing);
  }
  const ModelCamera& camera = *t.Part<ModelCamera>("camera");
  for (int i = 0; i < camera.getWidth() * camera.getHeight(); i++)
    expect(static_cast<double>(camera.FrameDepth()[i]));
  expect(t.Part<ModelActuator>("arm")->GetPosition());
  return count;
}

TEST_P(Fields, AcceptAnyNumberAndStayFinite) {
  for (const double value : {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 5e-324}) {
    SCOPED_TRACE(value);
    Things things;
    Step(*things.world, 2);
    GetParam().make(things, value);
    testing::internal::CaptureStderr();
    Step(*things.world, 4);
    for (const char* radio : {"a.radio", "b.radio"})
      EXPECT_TRUE(Find<ModelRadio>(*things.world, radio)->Send("hello", 5));
    Step(*things.world, 1);
    testing::internal::GetCapturedStderr();
    EXPECT_GT(ExpectNumbers(things), 1000u);
  }
}

INSTANTIATE_TEST_SUITE_P(Api, Fields, testing::ValuesIn(kFields), NameOf);

TEST(SensorNoise, NonFiniteNoiseCountsAsZero) {
  using Sensor = ModelRanger::Sensor;
  Things untouched;
  Step(*untouched.world, 5);
  for (double Sensor::*noise :
       {&Sensor::range_noise, &Sensor::range_noise_const, &Sensor::angle_noise})
    for (const double value : {kNaN, kInfinity, -kInfinity}) {
      Things things;
      things.sensor().*noise = value;
      Step(*things.world, 5);
      EXPECT_EQ(things.sensor().ranges, untouched.sensor().ranges) << value;
    }
}

TEST(Samples, BeyondTheLimitAreCutWithOneMessage) {
  Things things;
  auto* blobs = things.Part<ModelBlobfinder>("blobs");
  for (const unsigned count : {1000001u, 4294967295u}) {
    things.sensor().sample_count = count;
    blobs->scan_width = count;
    const std::string errors = ErrorsOf([&] { Step(*things.world, 3); });
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 2) << errors;
    const std::string found = "found " + std::to_string(count) + " samples of sensor 0, expected ";
    EXPECT_NE(errors.find("a.eye: " + found + "a number from 0 to 1000000;"), std::string::npos);
    EXPECT_NE(errors.find("a.blobs: found a width of " + std::to_string(count)), std::string::npos);
    EXPECT_EQ(things.sensor().sample_count, 1000000u);
    EXPECT_EQ(blobs->scan_width, 100000u);
    for (const auto* data :
         {&things.sensor().ranges, &things.sensor().intensities, &things.sensor().bearings})
      EXPECT_EQ(data->size(), 1000000u);
  }
  things.sensor().sample_count = 1000000;
  EXPECT_EQ(ErrorsOf([&] { Step(*things.world); }), "");
}

// ---- random combinations ------------------------------------------------------------------------

TEST(Everything, WorldSurvivesAllCallsTogether) {
  for (const double value : {kNaN, kInfinity, -kInfinity}) {
    Things things;
    testing::internal::CaptureStderr();
    for (int round = 0; round < 10; round++) {
      for (const Call& call : kRejected) call.make(things, value);
      for (const Call& call : kNotANumber) call.make(things, value);
      for (const Call& call : kFields) call.make(things, value);
      things.world->Raytrace(Pose(value, value, value, value), value, Anything, nullptr, nullptr,
                             true);
      Step(*things.world, 10);
    }
    testing::internal::GetCapturedStderr();
    EXPECT_EQ(things.world->GetUpdateCount(), 100u);
    for (const Model* model : things.world->GetAllModels()) {
      EXPECT_TRUE(IsFinite(model->GetPose())) << model->PrintWithPose();
      EXPECT_TRUE(IsFinite(model->GetGlobalPose())) << model->PrintWithPose();
    }
  }
}

// ---- rays ---------------------------------------------------------------------------------------

TEST(Rays, FromNonFinitePosesHitNothing) {
  Things t;
  for (const double v : {kNaN, kInfinity, -kInfinity})
    for (const Pose& from :
         {Pose(v, 0, 0.1, 0), Pose(0, v, 0.1, 0), Pose(0, 0, 0.1, v), Pose(0, 0, v, M_PI / 2)}) {
      const Ray ray(nullptr, from, 50, Anything, nullptr, true);
      EXPECT_EQ(t.world->Raytrace(ray).mod, nullptr) << from.String();
      EXPECT_EQ(t.world->Raytrace(ray).range, 50) << from.String();
    }
}

TEST(Rays, WithNonFiniteFieldOfViewLookAhead) {
  Things t;
  for (const double fov : {kNaN, kInfinity, -kInfinity}) {
    std::vector<RaytraceResult> results(3);
    t.world->Raytrace(Pose(0, 0, 0.5, M_PI / 2), 8, fov, Anything, nullptr, nullptr, true, results);
    for (const RaytraceResult& result : results) EXPECT_EQ(result.mod, t.wall) << fov;
  }
}

// ---- pictures ----------------------------------------------------------------------------------

TEST(Pictures, WithNonFiniteCellSizesStayEmpty) {
  Things t;
  for (const double v : {kNaN, kInfinity, -kInfinity, 0.0, 5e-324}) {
    uint8_t data[4] = {0, 0, 0, 0};
    t.wall->Rasterize(data, 2, 2, v, v);
    const int expected = std::isinf(v) ? 1 : 0;  // an infinite cell contains everything
    EXPECT_EQ(data[0], expected) << v;
    EXPECT_EQ(data[1] + data[2] + data[3], 0) << v;
  }
}

// ---- far away -----------------------------------------------------------------------------------

/// Sensors and targets are so far away that adjacent doubles are metres apart.
TEST(FarOut, SensorsKeepWorking) {
  for (const double far : {1e9, 1e15, 4e16, 1e17, 1e100, 1e300}) {
    Things t;
    t.robot->SetPose(Pose(far, 1000, 0, 1));
    Find(*t.world, "b")->SetPose(Pose(far, -1000, 0, 2));
    t.wall->SetPose(Pose(far, 500, 0, 2));
    Step(*t.world, 5);
    EXPECT_GT(ExpectNumbers(t), 1000u) << far;
    EXPECT_TRUE(t.Part<ModelFiducial>("finder")->GetFiducials().empty());
  }
}

}  // namespace
}  // namespace Stg::extremes
