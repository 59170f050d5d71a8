// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TESTS_SUPPORT_HEAP_DRIVER_HH
#define STAGE_TESTS_SUPPORT_HEAP_DRIVER_HH

#include <cstdint>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/heap_text.hh"
#include "world/engine.hh"

namespace test {

/// Commands all models, and now and then changes the world by itself. The changes depend only on
/// the seed and the number of steps made.
class HeapDriver {
 public:
  HeapDriver(const HeapText& heap, uint64_t seed, Stg::World* world)
      : heap_(heap), world_(*world), random_(seed * 1000003 + world->GetUpdateCount()) {}

  /// Returns true if something was changed other than commands.
  bool Drive() {
    for (Stg::Model* model : world_.host().models)  // in the order of creation
      if (random_.Uniform() < 0.3) Command(model);
    if (random_.Uniform() > 0.15) return false;
    Change();
    return true;
  }

 private:
  double Between(double low, double high) { return random_.Uniform(low, high); }

  void Command(Stg::Model* model) {
    const double speed = heap_.speed();
    if (auto* robot = dynamic_cast<Stg::ModelPosition*>(model)) {
      switch (random_.Choose(10)) {
        case 0:
          return robot->Stop();
        case 1:
          return robot->GoTo(heap_.center_x() + Between(-1, 1), heap_.center_y() + Between(-1, 1),
                             Between(-3, 3));
        case 2:
          return robot->SetAcceleration(Between(-1, 1), Between(-1, 1), Between(-2, 2));
        case 3:
          return robot->SetSpeed(0, 0, Between(-6, 6));
        default:
          return robot->SetSpeed(Between(-0.4, 1) * speed, Between(-0.5, 0.5) * speed,
                                 Between(-3, 3));
      }
    }
    if (auto* arm = dynamic_cast<Stg::ModelActuator*>(model)) arm->SetSpeed(Between(-1, 1) * speed);
    if (auto* gripper = dynamic_cast<Stg::ModelGripper*>(model))
      random_.Choose(2) ? gripper->CommandClose() : gripper->CommandOpen();
  }

  void Change() {
    std::vector<Stg::Model*> roots;
    for (Stg::Model* model : world_.host().models)
      if (!model->Parent() && model != world_.GetGround() &&
          !std::string(model->TokenStr()).starts_with("frame"))
        roots.push_back(model);
    if (roots.empty()) return;
    Stg::Model* root = roots[random_.Choose(static_cast<uint32_t>(roots.size()))];
    switch (random_.Choose(6)) {
      case 0:
        return root->SetPushable(!root->IsPushable());
      case 1:
        return root->SetObstacleReturn(random_.Choose(2));
      case 2: {
        const double size = Between(0.02, 0.5);
        return root->SetGeom(Stg::Geom(Stg::Pose(), Stg::Size(size, size, 0.25)));
      }
      default:
        const Stg::Pose before = root->GetPose();
        return root->SetPose(Stg::Pose(heap_.center_x() + Between(-0.9, 0.9) * heap_.half(),
                                       heap_.center_y() + Between(-0.9, 0.9) * heap_.half(),
                                       before.z, Between(-3, 3)));
    }
  }

  const HeapText& heap_;
  Stg::World& world_;
  Stg::RandomStream random_;
};

}  // namespace test

#endif
