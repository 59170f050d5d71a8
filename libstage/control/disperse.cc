// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/disperse: drives each robot to where it is emptiest, so that a
// crowd spreads.

#include <memory>
#include <stdexcept>

#include "control/stock_batch.hh"
#include "control/stock_list.hh"
#include "geometry/trigonometry.hh"
#include "models/position.hh"
#include "models/ranger.hh"

namespace Stg::control {

namespace {

/// Uses all sensors of all rangers of the robot that no other controller uses.
void UseRangers(ControllerSetup* setup) {
  auto* const first = dynamic_cast<ModelRanger*>(setup->robot().GetUnusedModelOfType("ranger"));
  if (!first)
    throw std::runtime_error("found no ranger that is not in use, expected one on the robot");
  setup->Use(first);
  while (ModelRanger* const next = setup->FindUnusedRanger()) setup->Use(next);
}

class Disperse : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    auto parameters = std::make_shared<StockParameters>();
    parameters->record.kind = ROW_DISPERSE;
    row_disperse_t& rule = parameters->record.rule.disperse;
    rule = {0.4, 1.0, 1.5, 0.1, 5.0, 0, 0, 0};
    setup->ReadNumbers({{"speed", &rule.speed, 0, 1000},
                        {"gain", &rule.gain, 0, 1000},
                        {"turn", &rule.turn, 0, 1000},
                        {"margin", &rule.margin, 0, 1000},
                        {"horizon", &rule.horizon, 0, 1000}});
    const Geom geom = setup->robot().GetGeom();
    rule.radius = Hypotenuse(geom.pose.x, geom.pose.y) + Hypotenuse(geom.size.x, geom.size.y) / 2 +
                  rule.margin;
    UseRangers(setup);
    parameters->horizon = rule.horizon;
    parameters->layout = FindRayLayout(setup->sensors(), rule.horizon);
    rule.cosines = parameters->layout->cosines();
    rule.sines = parameters->layout->sines();
    return parameters;
  }

  void Step(const ControllerBatch& batch) const override { DriveAllByReadings(batch, Drive); }

  size_t memory_size() const override { return 1; }

 private:
  static void Drive(const InBatch& at, const double* ranges, row_planar_t* command) {
    const StockParameters& parameters = at.parameters();
    const row_disperse_t& rule = parameters.record.rule.disperse;
    if (row_back_off(&rule, at.batch.stalled[at.index()], &at.batch.memory[at.index()], command))
      return;
    const row_layout_t* const layout = parameters.layout->record();
    row_look_t looks[ROW_SECTOR_COUNT];
    for (ray_uint i = 0; i < layout->sector_count; i++)
      row_look(layout, i, rule.radius, ranges, looks);
    for (ray_uint i = 0; i < layout->sector_count; i++) row_find_push(layout, i, &rule, looks);
    row_disperse(layout, &rule, looks, command);
  }
};

}  // namespace

const BatchController* DisperseController() {
  static const Disperse controller;
  return &controller;
}

}  // namespace Stg::control
