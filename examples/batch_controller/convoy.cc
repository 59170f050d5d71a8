// SPDX-License-Identifier: GPL-2.0-or-later
//
// convoy: each robot follows the one that was created before it, and keeps a distance. The first
// robot of the world has none before it and needs another controller.
//
//   ctrl "convoy [distance=0.8] [speed=0.5]"
//
// A batch controller: one call drives all its robots of a world, and none of them has a callback.

#include <algorithm>

#include "geometry/trigonometry.hh"
#include "stage.hh"

namespace {

struct Parameters : Stg::ControllerParameters {
  double distance = 0.8;  ///< m
  double speed = 0.5;     ///< m/s
};

class Convoy : public Stg::BatchController {
 public:
  std::shared_ptr<const Stg::ControllerParameters> Prepare(
      Stg::ControllerSetup* setup) const override {
    auto parameters = std::make_shared<Parameters>();
    setup->ReadNumbers({{"distance", &parameters->distance, 0, 100},  //
                        {"speed", &parameters->speed, 0, 100}});
    return parameters;
  }

  bool needs_poses() const override { return true; }

  void Step(const Stg::ControllerBatch& batch) const override {
    for (size_t world = 0; world < batch.worlds; world++) {
      const Stg::PlanarPose* const all = batch.all_poses + world * batch.all_robots;
      for (size_t robot = 0; robot < batch.robots; robot++) {
        const uint32_t own = batch.own[robot];
        if (own > 0)
          batch.command[world * batch.robots + robot] =
              Follow(all[own - 1], all[own],
                     static_cast<const Parameters&>(*batch.robot[robot]->parameters));
      }
    }
  }

 private:
  static Stg::PlanarVelocity Follow(const Stg::PlanarPose& ahead, const Stg::PlanarPose& own,
                                    const Parameters& parameters) {
    const double x = ahead.x - own.x, y = ahead.y - own.y;
    const double gap = Stg::Hypotenuse(x, y) - parameters.distance;
    const double off_course = Stg::normalize(Stg::ArcTangent(y, x) - own.a);
    return {Stg::constrain(gap, 0, parameters.speed), 0, Stg::constrain(2 * off_course, -2, 2)};
  }
};

}  // namespace

STAGE_EXPORT_BATCH_CONTROLLER(Convoy)
