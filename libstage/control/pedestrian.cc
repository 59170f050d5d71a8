// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/pedestrian: walks to a place and evades others by social forces.
// See docs/controllers.md.

#include <limits>
#include <memory>

#include "control/stock_batch.hh"
#include "control/stock_list.hh"
#include "geometry/trigonometry.hh"
#include "models/position.hh"
#include "models/ranger.hh"

namespace Stg::control {

namespace {

class Pedestrian : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    constexpr double kFar = 1e9, kRequired = std::numeric_limits<double>::quiet_NaN();
    constexpr double kLeast = 1e-3;  // of what the rule divides by
    const Geom geom = setup->robot().GetGeom();
    auto parameters = std::make_shared<StockParameters>();
    parameters->record.kind = ROW_PEDESTRIAN;
    row_pedestrian_t& rule = parameters->record.rule.pedestrian;
    rule = {.x = kRequired,
            .y = kRequired,
            .tolerance = 0.2,
            .speed = 0.7,
            .time = 0.5,
            .turn = 3.0,
            .repulsion = 3.0,
            .reach = 0.3,
            .wall = 10.0,
            .wall_reach = 0.2,
            .behind = 0.5,
            .radius = Hypotenuse(geom.size.x, geom.size.y) / 2};
    setup->ReadNumbers({{"x", &rule.x, -kFar, kFar},
                        {"y", &rule.y, -kFar, kFar},
                        {"tolerance", &rule.tolerance, kLeast, 1000},
                        {"speed", &rule.speed, 0, 1000},
                        {"time", &rule.time, kLeast, 1000},
                        {"turn", &rule.turn, 0, 1000},
                        {"repulsion", &rule.repulsion, 0, 1e6},
                        {"reach", &rule.reach, kLeast, 1000},
                        {"wall", &rule.wall, 0, 1e6},
                        {"wall_reach", &rule.wall_reach, kLeast, 1000},
                        {"behind", &rule.behind, 0, 1},
                        {"radius", &rule.radius, 0, 1000}});
    while (ModelRanger* const ranger = setup->FindUnusedRanger()) setup->Use(ranger);
    parameters->horizon = kFar;
    parameters->layout = FindRayLayout(setup->sensors(), kFar);
    return parameters;
  }

  void Step(const ControllerBatch& batch) const override {
    static thread_local std::vector<double> buffer;
    DriveAll(batch, [](const InBatch& at, row_planar_t* command) {
      const double* const ranges = ReadingsOf(at, &buffer);
      if (!ranges) return;
      const row_layout_t* const layout = at.parameters().layout->record();
      row_walk(&at.parameters().record.rule.pedestrian, layout, ranges, at.all_poses(),
               static_cast<ray_uint>(at.batch.all_robots), at.batch.own[at.robot],
               at.batch.time[at.world], at.batch.stalled[at.index()],
               at.batch.memory + 3 * at.index(), command);
    });
  }

  size_t memory_size() const override { return 3; }
  bool needs_poses() const override { return true; }
};

}  // namespace

const BatchController* PedestrianController() {
  static const Pedestrian controller;
  return &controller;
}

}  // namespace Stg::control
