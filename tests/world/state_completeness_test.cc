// SPDX-License-Identifier: GPL-2.0-or-later
//
// All data that determines the future of a world is part of its state: each change by the interface
// changes the state hash, and restoring the saved state restores the hash.

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "support/all_models.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// A world with a model of every type, after some steps.
struct Scene {
  Scene()
      : world(LoadText(
            "define robot position( name \"robot\" size [0.4 0.4 0.3] joules 1000 mass 3 alwayson "
            "1\n"
            "  ranger( name \"ranger\" alwayson 1 sensor( range [0 6] fov 180 samples 19 ) )\n"
            "  blobfinder( name \"blobfinder\" alwayson 1 image [20 10] )\n"
            "  fiducial( name \"fiducial\" alwayson 1 range_max 6 )\n"
            "  bumper( name \"bumper\" alwayson 1 bcount 1 bpose[0] [0.2 0 0 0] blength 0.4 )\n"
            "  camera( name \"camera\" alwayson 1 resolution [8 6] )\n"
            "  gripper( name \"gripper\" alwayson 1 )\n"
            "  actuator( name \"actuator\" alwayson 1 size [0.1 0.1 0.1] max_speed 1 )\n"
            "  wifi( name \"wifi\" alwayson 1 model \"friis\" power 100 range 5 )\n"
            "  groundsensor( name \"ground\" alwayson 1 points 2 )\n"
            "  field( name \"field\" size [1 1 0] )\n"
            "  radio( name \"radio\" alwayson 1 )\n"
            "  light( name \"lamp\" ) lightsensor( name \"lightsensor\" )\n"
            "  lightindicator( name \"light\" ) )\n"
            "robot( pose [-2 0 0 0] fiducial_return 1 )\n"
            "robot( name \"other\" pose [0 0.1 0 180] fiducial_return 2 )\n"
            "model( name \"wall\" pose [0 3 0 0] size [8 0.2 1] )\n")) {
    Step(*world, 3);
  }
  template <class M>
  M* Part(const std::string& name) const {
    return Find<M>(*world, "robot." + name);
  }
  ModelPosition* robot() const { return Find<ModelPosition>(*world, "robot"); }
  Model* wall() const { return Find(*world, "wall"); }
  ModelRanger::Sensor& sensor() const {
    return Part<ModelRanger>("ranger")->GetSensorsMutable()[0];
  }

  std::vector<Model*> Models() const { return all_models::ByNumber(world.get()); }
  StateExchange::Bytes Save() const {
    StateExchange::Bytes bytes;
    const std::vector<Model*> models = Models();
    StateExchange exchange(models, &bytes);
    for (Model* model : models) model->ExchangeState(exchange);
    return bytes;
  }
  /// Restores the state. Returns an error; empty: none.
  std::string Restore(const StateExchange::Bytes& bytes) const {
    const std::vector<Model*> models = Models();
    StateExchange exchange(models, bytes.data(), bytes.size());
    for (Model* model : models) model->ExchangeState(exchange);
    EXPECT_TRUE(exchange.failed() || exchange.left() == 0);
    return exchange.message();
  }

  std::unique_ptr<World> world;
};

struct Change {
  std::string name;
  std::function<void(const Scene&)> make;
  bool comes_back = true;  // restoring undoes it; false for creating and deleting models
};

void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

template <class M>
Change Of(const std::string& part, const std::string& field, void (*make)(M*)) {
  return {part + "_" + field, [=](const Scene& scene) { make(scene.Part<M>(part)); }};
}

std::vector<Change> AllChanges() {
  static Model::Flag flag(Color(1, 0, 0), 0.2);
  std::vector<Change> all = {
      {"pose", [](const Scene& s) { s.wall()->SetPose(Pose(0, 3.5, 0, 0)); }},
      {"geometry", [](const Scene& s) { s.wall()->SetGeom(Geom(Pose(), Size(4, 0.2, 1))); }},
      {"color", [](const Scene& s) { s.wall()->SetColor(Color(0, 1, 0)); }},
      {"mass", [](const Scene& s) { s.wall()->SetMass(7); }},
      {"friction", [](const Scene& s) { s.wall()->SetFriction(7); }},
      {"map_resolution", [](const Scene& s) { s.wall()->SetMapResolution(0.7); }},
      {"boundary", [](const Scene& s) { s.wall()->SetBoundary(true); }},
      {"watts", [](const Scene& s) { s.wall()->SetWatts(7); }},
      {"stall", [](const Scene& s) { s.wall()->SetStall(true); }},
      {"disabled", [](const Scene& s) { s.wall()->Disable(); }},
      {"speech", [](const Scene& s) { s.wall()->Say("hello"); }},
      {"name", [](const Scene& s) { s.wall()->SetToken("fence"); }, false},
      {"subscription", [](const Scene& s) { s.wall()->Subscribe(); }, false},
      {"fiducial_return", [](const Scene& s) { s.wall()->SetFiducialReturn(7); }},
      {"key_for_fiducials", [](const Scene& s) { s.wall()->SetFiducialKey(7); }},
      {"obstacle_return", [](const Scene& s) { s.wall()->SetObstacleReturn(false); }},
      {"blob_return", [](const Scene& s) { s.wall()->SetBlobReturn(false); }},
      {"gripper_return", [](const Scene& s) { s.wall()->SetGripperReturn(true); }},
      {"ranger_return", [](const Scene& s) { s.wall()->SetRangerReturn(0.5); }},
      {"random_stream", [](const Scene& s) { s.wall()->random().Next(); }},
      {"one_more_block", [](const Scene& s) { s.wall()->AddBlockRect(0, 0, 0.1, 0.1, 0.1); }},
      {"no_blocks", [](const Scene& s) { s.wall()->ClearBlocks(); }},
      {"flag", [](const Scene& s) { s.wall()->AddFlag(&flag); }, false},
      {"taken", [](const Scene& s) { s.wall()->GetUnusedModelOfType("model"); }},
      {"child_made", [](const Scene& s) { s.world->CreateModel(s.wall(), "model"); }, false},
      {"energy", [](const Scene& s) { s.robot()->FindPowerPack()->SetStored(900); }},
      {"capacity", [](const Scene& s) { s.robot()->FindPowerPack()->SetCapacity(2000); }},
      {"dissipated", [](const Scene& s) { s.robot()->FindPowerPack()->Dissipate(1); }},
      {"charging", [](const Scene& s) { s.robot()->FindPowerPack()->ChargeStart(); }},
      {"speed", [](const Scene& s) { s.robot()->SetSpeed(0.3, 0, 0.1); }},
      {"goal", [](const Scene& s) { s.robot()->GoTo(1, 2, 3); }},
      {"acceleration", [](const Scene& s) { s.robot()->SetAcceleration(0.1, 0, 0); }},
      {"velocity", [](const Scene& s) { s.robot()->SetVelocity(Velocity(0.1, 0, 0, 0)); }},
      {"odometry", [](const Scene& s) { s.robot()->SetOdom(Pose(1, 1, 0, 1)); }},
      {"estimate", [](const Scene& s) { s.robot()->est_pose.x += 1; }},
      {"origin_of_estimate", [](const Scene& s) { s.robot()->est_origin.y += 1; }},
      {"velocity_bounds", [](const Scene& s) { s.robot()->velocity_bounds[3].max = 7; }},
      {"acceleration_bounds", [](const Scene& s) { s.robot()->acceleration_bounds[0].min = -7; }},
      {"waypoints", [](const Scene& s) { s.robot()->waypoints.emplace_back(1, 2, 0, 0, Color()); }},
      {"sensor_pose", [](const Scene& s) { s.sensor().pose.x += 0.1; }},
      {"sensor_size", [](const Scene& s) { s.sensor().size.z += 0.1; }},
      {"sensor_range", [](const Scene& s) { s.sensor().range.max = 4; }},
      {"sensor_fov", [](const Scene& s) { s.sensor().fov = 1; }},
      {"sensor_angle_noise", [](const Scene& s) { s.sensor().angle_noise = 0.1; }},
      {"sensor_range_noise", [](const Scene& s) { s.sensor().range_noise = 0.1; }},
      {"sensor_constant_noise", [](const Scene& s) { s.sensor().range_noise_const = 0.1; }},
      {"sensor_samples", [](const Scene& s) { s.sensor().sample_count = 7; }},
      {"sensor_color", [](const Scene& s) { s.sensor().color = Color(0, 0, 1); }},
      {"sensor_ray_model", [](const Scene& s) { s.sensor().ray_model = RayModel::kExact; }},
      {"sensor_ranges", [](const Scene& s) { s.sensor().ranges[0] += 1; }},
      {"sensor_intensities", [](const Scene& s) { s.sensor().intensities[0] += 1; }},
      {"sensor_bearings", [](const Scene& s) { s.sensor().bearings[0] += 1; }},
      {"step", [](const Scene& s) { s.world->Update(); }, false},
      {"interval_of_steps", [](const Scene& s) { s.world->sim_interval = 50000; }, false},
      {"timed_callback",
       [](const Scene& s) {
         s.world->Enqueue(
             0, 100, s.wall(), [](Model*, void*) { return 0; }, nullptr);
       },
       false},
      {"order_in_a_cell",
       [](const Scene& s) { s.world->CreateModel(nullptr, "model")->SetPose(Pose(-2, 0, 0, 0)); },
       false},
  };
  const auto add = [&](Change change) { all.push_back(std::move(change)); };
  add(Of<ModelBlobfinder>("blobfinder", "fov", [](auto* m) { m->fov = 1; }));
  add(Of<ModelBlobfinder>("blobfinder", "pan", [](auto* m) { m->pan = 1; }));
  add(Of<ModelBlobfinder>("blobfinder", "range", [](auto* m) { m->range = 1; }));
  add(Of<ModelBlobfinder>("blobfinder", "height", [](auto* m) { m->scan_height = 7; }));
  add(Of<ModelBlobfinder>("blobfinder", "width", [](auto* m) { m->scan_width = 7; }));
  add(Of<ModelBlobfinder>("blobfinder", "color", [](auto* m) { m->AddColor(Color(0, 0, 1)); }));
  add(Of<ModelBlobfinder>("blobfinder", "blobs", [](auto* m) { m->GetBlobsMutable().clear(); }));
  add(Of<ModelFiducial>("fiducial", "range", [](auto* m) { m->max_range_anon = 3; }));
  add(Of<ModelFiducial>("fiducial", "range_of_ids", [](auto* m) { m->max_range_id = 3; }));
  add(Of<ModelFiducial>("fiducial", "least_range", [](auto* m) { m->min_range = 0.3; }));
  add(Of<ModelFiducial>("fiducial", "fov", [](auto* m) { m->fov = 0.3; }));
  add(Of<ModelFiducial>("fiducial", "heading", [](auto* m) { m->heading = 0.3; }));
  add(Of<ModelFiducial>("fiducial", "key", [](auto* m) { m->key = 3; }));
  add(Of<ModelFiducial>("fiducial", "heights", [](auto* m) { m->ignore_zloc = !m->ignore_zloc; }));
  add(Of<ModelFiducial>("fiducial", "found", [](auto* m) { m->GetFiducials().clear(); }));
  add(Of<ModelBumper>("bumper", "pose", [](auto* m) { m->bumpers[0].pose.x += 0.1; }));
  add(Of<ModelBumper>("bumper", "length", [](auto* m) { m->bumpers[0].length += 0.1; }));
  add(Of<ModelBumper>("bumper", "touched", [](auto* m) { m->samples[0].hit = m; }));
  add(Of<ModelBumper>("bumper", "point", [](auto* m) { m->samples[0].hit_point.x += 1; }));
  add(Of<ModelCamera>("camera", "yaw", [](auto* m) { m->setYaw(10); }));
  add(Of<ModelCamera>("camera", "pitch", [](auto* m) { m->setPitch(10); }));
  add(Of<ModelGripper>("gripper", "command", [](auto* m) { m->CommandClose(); }));
  add(Of<ModelGripper>("gripper", "paddles", [](auto* m) {
    ModelGripper::config_t config = m->GetConfig();
    config.paddle_position = 0.5;
    m->SetConfig(config);
  }));
  add(Of<ModelActuator>("actuator", "speed", [](auto* m) { m->SetSpeed(0.1); }));
  add(Of<ModelActuator>("actuator", "goal", [](auto* m) { m->GoTo(0.1); }));
  add(Of<ModelWifi>("wifi", "model",
                    [](auto* m) { m->propagation = ModelWifi::PROPAGATION_NONE; }));
  add(Of<ModelWifi>("wifi", "ip", [](auto* m) { m->ip = "10.0.0.7"; }));
  add(Of<ModelWifi>("wifi", "mac", [](auto* m) { m->mac = "7"; }));
  add(Of<ModelWifi>("wifi", "essid", [](auto* m) { m->essid = "7"; }));
  add(Of<ModelWifi>("wifi", "power", [](auto* m) { m->power += 1; }));
  add(Of<ModelWifi>("wifi", "sensitivity", [](auto* m) { m->sensitivity += 1; }));
  add(Of<ModelWifi>("wifi", "frequency", [](auto* m) { m->freq += 1; }));
  add(Of<ModelWifi>("wifi", "range", [](auto* m) { m->range += 1; }));
  add(Of<ModelWifi>("wifi", "plc", [](auto* m) { m->plc += 1; }));
  add(Of<ModelWifi>("wifi", "ple", [](auto* m) { m->ple += 1; }));
  add(Of<ModelWifi>("wifi", "sigma", [](auto* m) { m->sigma += 1; }));
  add(Of<ModelWifi>("wifi", "walls", [](auto* m) { m->wall_factor += 1; }));
  add(Of<ModelWifi>("wifi", "drawn_range", [](auto* m) { m->range_db += 1; }));
  add(Of<ModelGroundSensor>("ground", "deposit", [](auto* m) { m->Deposit(2); }));
  add(Of<ModelGroundSensor>("ground", "rate", [](auto* m) { m->SetDepositRate(2); }));
  add(Of<ModelField>("field", "value", [](auto* m) {
    const point_t middle = m->LocalToGlobal(point_t(0, 0));
    m->SetValue(middle.x, middle.y, 7);
  }));
  add(Of<ModelField>("field", "diffusion", [](auto* m) { m->SetDiffusion(0.1); }));
  add(Of<ModelField>("field", "evaporation", [](auto* m) { m->SetEvaporation(0.1); }));
  add(Of<ModelRadio>("radio", "range", [](auto* m) { m->range += 1; }));
  add(Of<ModelRadio>("radio", "sight", [](auto* m) { m->line_of_sight = true; }));
  add(Of<ModelRadio>("radio", "delay", [](auto* m) { m->delay = 3; }));
  add(Of<ModelRadio>("radio", "channel", [](auto* m) { m->channel = 3; }));
  add(Of<ModelRadio>("radio", "loss", [](auto* m) { m->loss = 0.5; }));
  add(Of<ModelRadio>("radio", "range_noise", [](auto* m) { m->range_noise = 0.5; }));
  add(Of<ModelRadio>("radio", "bearing_noise", [](auto* m) { m->bearing_noise = 0.5; }));
  add(Of<ModelRadio>("radio", "collisions", [](auto* m) { m->collisions = true; }));
  add(Of<ModelRadio>("radio", "capacity", [](auto* m) { m->capacity = 3; }));
  add(Of<ModelRadio>("radio", "message", [](auto* m) { m->Send("hello", 5); }));
  add(Of<ModelLightIndicator>("light", "state", [](auto* m) { m->SetState(true); }));
  add(Of<ModelLight>("lamp", "off", [](auto* m) { m->SetOn(false); }));
  add(Of<ModelLight>("lamp", "intensity", [](auto* m) { m->SetIntensity(7); }));
  using Eye = ModelLightSensor;
  const auto add_eye = [&](const char* what, void (*change)(Eye*)) {
    add(Of<Eye>("lightsensor", what, change));
  };
  add_eye("directions", [](Eye* m) { m->directions[0] += 1; });
  add_eye("range", [](Eye* m) { m->range += 1; });
  add_eye("fov", [](Eye* m) { m->fov = 1; });
  add_eye("cosine_power", [](Eye* m) { m->cosine_power++; });
  add_eye("shadows", [](Eye* m) { m->shadows = false; });
  add_eye("least_distance", [](Eye* m) { m->least_distance += 1; });
  add_eye("ambient", [](Eye* m) { m->ambient += 1; });
  add_eye("noise", [](Eye* m) { m->noise += 1; });
  add_eye("relative_noise", [](Eye* m) { m->relative_noise += 1; });
  add_eye("saturation", [](Eye* m) { m->saturation = 7; });
  return all;
}

class State : public testing::TestWithParam<Change> {};

TEST_P(State, ChangesWithEachChange) {
  const Scene scene;
  const uint64_t before = scene.world->StateHash();
  const StateExchange::Bytes saved = scene.Save();
  EXPECT_EQ(scene.world->StateHash(), before) << "reading changes nothing";
  GetParam().make(scene);
  EXPECT_NE(scene.world->StateHash(), before);
  if (!GetParam().comes_back) return;
  EXPECT_EQ(scene.Restore(saved), "");
  EXPECT_EQ(scene.Save(), saved);
}

TEST_P(State, IsRestoredBySnapshots) {
  const Scene scene;
  Snapshot before, changed, after;
  ASSERT_TRUE(scene.world->Take(&before));
  const uint64_t hash = scene.world->StateHash();
  Step(*scene.world, 5);
  const uint64_t later = scene.world->StateHash();
  ASSERT_TRUE(scene.world->Restore(before));
  GetParam().make(scene);
  if (GetParam().name == "timed_callback") {
    EXPECT_NE(ErrorsOf([&] { EXPECT_FALSE(scene.world->Take(&changed)); }).find("\"wall\""),
              std::string::npos);
    return;
  }
  ASSERT_TRUE(scene.world->Take(&changed));
  EXPECT_NE(changed.hash(), before.hash());
  ASSERT_TRUE(scene.world->Restore(before));
  EXPECT_EQ(scene.world->StateHash(), hash);
  ASSERT_TRUE(scene.world->Take(&after));
  EXPECT_EQ(after.hash(), before.hash());
  Step(*scene.world, 5);
  EXPECT_EQ(scene.world->StateHash(), later);
}

INSTANTIATE_TEST_SUITE_P(Changes, State, testing::ValuesIn(AllChanges()),
                         [](const auto& change) { return change.param.name; });

TEST(StateOfControllers, IsPartOfTheState) {
  const auto world = LoadText("model( name \"m\" )");
  Model* model = Find(*world, "m");
  const uint64_t nobody = world->StateHash();
  int count = 3;
  model->KeepState("counter", &count, sizeof count);
  const uint64_t three = world->StateHash();
  EXPECT_NE(three, nobody);
  count = 4;
  EXPECT_NE(world->StateHash(), three);
  count = 3;
  EXPECT_EQ(world->StateHash(), three);
}

TEST(StateExchanged, IsRefusedWhereItDoesNotFit) {
  const Scene scene;
  StateExchange::Bytes saved = scene.Save();
  const auto other = LoadText("position( name \"m\" )");
  const std::vector<Model*> models = {Find(*other, "m")};
  StateExchange exchange(models, saved.data(), saved.size());
  models[0]->ExchangeState(exchange);
  EXPECT_TRUE(exchange.failed());
  EXPECT_NE(exchange.message(), "");
  saved.resize(saved.size() / 2);
  EXPECT_EQ(scene.Restore(saved), "the state ends too early");
}

}  // namespace
}  // namespace Stg
