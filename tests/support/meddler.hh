// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world with models of all types, and random changes of them.

#ifndef STAGE_TESTS_SUPPORT_MEDDLER_HH
#define STAGE_TESTS_SUPPORT_MEDDLER_HH

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/all_models.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"

namespace Stg {

/// Two robots with a device of every type, some obstacles, and a puck that carries a lid.
inline const char kRobotsOfAllTypes[] =
    "resolution 0.05\n"
    "define robot position( size [0.4 0.4 0.3] joules 1000 alwayson 1 fiducial_return 1\n"
    "  ranger( alwayson 1 sensor( range [0 6] fov 180 samples 19 noise [0.01 0.01 0] ) )\n"
    "  blobfinder( alwayson 1 image [20 10] )\n"
    "  fiducial( alwayson 1 range_max 6 )\n"
    "  bumper( alwayson 1 bcount 1 bpose[0] [0.2 0 0 0] blength 0.4 )\n"
    "  camera( alwayson 1 resolution [8 6] )\n"
    "  gripper( pose [0.25 0 0 0] alwayson 1 )\n"
    "  actuator( alwayson 1 size [0.1 0.1 0.1] max_speed 1 )\n"
    "  wifi( alwayson 1 model \"simple\" range 5 )\n"
    "  groundsensor( alwayson 1 points 2 point[1] [0.1 0] noise 0.1 deposit_rate 0.5 )\n"
    "  radio( alwayson 1 range 5 line_of_sight 1 delay 1 loss 0.1 range_noise 0.1 )\n"
    "  light() lightsensor( alwayson 1 noise [0.1 0.1] )\n"
    "  lightindicator() )\n"
    "robot( name \"a\" pose [-2 0 0 0] )\n"
    "robot( name \"b\" pose [0 0.1 0 180] fiducial_return 2 )\n"
    "model( name \"wall\" pose [0 3 0 0] size [8 0.2 1] )\n"
    "model( name \"zone\" pose [0 0 0 0] size [2 2 0.01] obstacle_return 0 )\n"
    "model( name \"puck\" pose [-1 0 0 0] size [0.1 0.1 0.2] gripper_return 1\n"
    "  block( points 3 point[0] [0 0] point[1] [1 0] point[2] [0 1] z [0 1] )\n"
    "  model( name \"lid\" size [0.05 0.05 0.05] ) )\n"
    "blinkenlight( intensity 1 pose [1 1 0 0] size [0.1 0.1 0.1] )\n"
    "field( name \"trail\" size [6 6 0] field_resolution 0.2 diffusion 0.01 evaporation 0.1 )\n";

inline std::unique_ptr<World> LoadRobotsOfAllTypes(uint64_t seed, bool exact = false) {
  auto world = std::make_unique<World>(OptionsOf(seed));
  std::istringstream content((exact ? "ray_model \"exact\"\n" : "") +
                             std::string(kRobotsOfAllTypes));
  EXPECT_TRUE(world->Load(content, "all.world"));
  return world;
}

/// Makes random changes of a world, determined by the seed and the world's models.
class Meddler {
 public:
  /// `reach`: max distance from the origin along each axis at which models are placed, metres.
  Meddler(World* world, uint64_t seed, double reach = 3)
      : world_(*world), random_(seed), reach_(reach) {}

  void Do() {
    const std::vector<Model*> models = all_models::ByNumber(&world_);
    Model* const model = models[static_cast<size_t>(random_.Next() % models.size())];
    Model* const other = models[static_cast<size_t>(random_.Next() % models.size())];
    if (model == world_.GetGround()) return;
    if (random_.OneIn(3)) return Drive();
    DoTo(model, other);
  }

 private:
  Pose NearBy() {
    const double x = random_.Real(-reach_, reach_), y = random_.Real(-reach_, reach_);
    return Pose(x, y, 0, random_.Real(-4, 4));
  }

  void Drive() {
    for (Model* model : all_models::ByNumber(&world_)) {
      if (auto* position = dynamic_cast<ModelPosition*>(model))
        position->SetSpeed(random_.Real(-1, 1), 0, random_.Real(-1, 1));
      if (auto* gripper = dynamic_cast<ModelGripper*>(model))
        random_.OneIn(2) ? gripper->CommandClose() : gripper->CommandOpen();
      if (auto* radio = dynamic_cast<ModelRadio*>(model)) radio->Send("hello", random_.Next() % 6);
    }
  }

  void DoTo(Model* model, Model* other) {
    switch (random_.Int(0, 17)) {
      case 0:
        return model->SetPose(NearBy());
      case 1:
        return model->SetColor(Color(random_.Real(0, 1), 0, 1));
      case 2:
        return model->SetFiducialReturn(random_.Int(0, 3));
      case 3:
        return model->Say(random_.OneIn(2) ? "hello" : "");
      case 4:
        return model->PushFlag(NewFlag(random_.Real(0, 1)));
      case 5:
        return static_cast<void>(model->PopFlag());
      case 6:
        return Create(random_.OneIn(2) ? other : nullptr);
      case 7:
        if (random_.OneIn(2)) delete model;
        return;
      case 8:
        if (other != world_.GetGround()) model->SetParent(other);
        return;
      case 9:
        return static_cast<void>(model->SetParent(nullptr));
      case 10:
        return model->SetObstacleReturn(random_.OneIn(2));
      case 11:
        return model->SetRangerReturn(random_.OneIn(2) ? -1 : 1);
      case 12:
        return model->AddBlockRect(0, 0, random_.Real(0.1, 0.5), 0.2, 0.5);
      case 13:
        return model->ClearBlocks();
      case 14:
        return random_.OneIn(2) ? model->Subscribe() : model->Enable();
      case 15:
        return model->Disable();
      case 16:
        return model->SetGeom(Geom(Pose(), Size(random_.Real(0.1, 1), 0.3, 0.4)));
      default:
        return model->SetToken("m" + std::to_string(random_.Int(0, 20)));
    }
  }

  void Create(Model* parent) {
    const char* const kTypes[] = {"model",    "position", "ranger",       "gripper",
                                  "bumper",   "fiducial", "blobfinder",   "camera",
                                  "actuator", "wifi",     "blinkenlight", "lightindicator",
                                  "radio",    "light",    "lightsensor"};
    Model* const made = world_.CreateModel(parent == world_.GetGround() ? nullptr : parent,
                                           kTypes[random_.Int(0, 14)]);
    made->SetPose(NearBy());
    if (random_.OneIn(2)) made->Subscribe();
  }

  /// Models don't own their flags. These are never freed, because any model may carry one.
  static Model::Flag* NewFlag(double size) {
    static std::mutex mutex;
    static std::deque<Model::Flag> flags;
    const std::lock_guard<std::mutex> lock(mutex);
    return &flags.emplace_back(Color(0, 1, 0), size);
  }

  World& world_;
  test::RandomSource random_;
  double reach_;
};

/// Makes the random changes that follow step number `step`.
inline void Meddle(World* world, uint64_t seed, int step, double reach = 3) {
  Meddler meddler(world, seed * 1000 + static_cast<uint64_t>(step), reach);
  for (int k = 0; k < 3; k++) meddler.Do();
}

/// Makes `steps` steps, each followed by its random changes.
inline void Go(World* world, uint64_t seed, int first, int steps, double reach = 3) {
  for (int i = first; i < first + steps; i++) {
    world->Update();
    Meddle(world, seed, i, reach);
  }
}

}  // namespace Stg

#endif
