// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_GRIPPER_TESTING_HH
#define STAGE_TESTS_GRIPPER_TESTING_HH

#include <algorithm>
#include <memory>
#include <string>

#include "models/body.hh"
#include "support/model_testing.hh"

/// Helpers for tests of grippers.
namespace Stg {

using Gripper = ModelGripper;

/// A robot with a subscribed gripper "r.g". Its fingers extend from x = 0.198 to 0.33, from y =
/// -0.15 to 0.15, and from z = 0.02 to 0.1.
struct Robot {
  explicit Robot(const std::string& rest = "", const std::string& properties = "",
                 const std::string& pose = "0 0 0 0")
      : world(LoadText("position( name \"r\" pose [" + pose +
                       "] size [0.3 0.3 0.22] gripper( name \"g\" pose [0.23 0 -0.2 0] " +
                       properties + " ) )\n" + rest)),
        gripper(FindRunning<Gripper>(*world, "r.g")) {}
  Gripper::config_t Step(int count = 1) {
    Stg::Step(*world, count);
    return gripper->GetConfig();
  }
  std::unique_ptr<World> world;
  Gripper* gripper;
};

inline std::string Puck(const std::string& pose = "0.25 0 0 0", const std::string& more = "") {
  return "model( name \"puck\" pose [" + pose +
         "] size [0.08 0.08 0.1] gripper_return 1 color \"blue\" " + more + " )\n";
}

/// The bounding box of a block in the gripper's frame.
inline bounds3d_t BoxOf(const Model* model, size_t index) {
  const Block& block = *model->body().blocks().at(index);
  bounds3d_t box(Bounds(1e9, -1e9), Bounds(1e9, -1e9), block.z_range());
  for (const point_t& p : block.points()) {
    box.x = Bounds(std::min(box.x.min, p.x), std::max(box.x.max, p.x));
    box.y = Bounds(std::min(box.y.min, p.y), std::max(box.y.max, p.y));
  }
  return box;
}

inline void ExpectBounds(const Bounds& bounds, double min, double max) {
  EXPECT_NEAR(bounds.min, min, 1e-9);
  EXPECT_NEAR(bounds.max, max, 1e-9);
}

}  // namespace Stg

#endif
