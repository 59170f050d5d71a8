// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/pedestrian: walks to a place and evades others by social forces.
// See docs/controllers.md.

#include <memory>
#include <utility>

#include "control/company_setup.hh"
#include "control/route_setup.hh"
#include "control/stock_batch.hh"
#include "control/stock_list.hh"
#include "kernels/row_pedestrian.h"

namespace Stg::control {

namespace {

class Pedestrian : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    auto parameters = std::make_shared<StockParameters>();
    parameters->record.kind = ROW_PEDESTRIAN;
    row_pedestrian_t& rule = parameters->record.rule.pedestrian;
    rule.speed = 0.7;
    std::vector<ControllerNumber> numbers = {{"speed", &rule.speed, 0, 1000}};
    for (const ControllerNumber& number : WalkerNumbers(&rule.walker, setup->robot()))
      numbers.push_back(number);
    for (const ControllerNumber& number : GroupNumbers(&rule.group)) numbers.push_back(number);
    ReadRoute(*setup, std::move(numbers), &rule.route);
    CheckGroup(rule.group);
    UseRangers(setup, parameters.get());
    return parameters;
  }

  void Step(const ControllerBatch& batch) const override {
    DriveAllByReadings(batch, [](const InBatch& at, const double* ranges, row_planar_t* command) {
      const row_company_t all = at.all();
      row_walk(&at.parameters().record.rule.pedestrian, at.parameters().layout->record(), ranges,
               &all, at.batch.time[at.world], at.batch.stalled[at.index()],
               at.batch.memory + ROW_PEDESTRIAN_SIZE * at.index(), command);
    });
  }

  size_t memory_size() const override { return ROW_PEDESTRIAN_SIZE; }
  bool needs_poses() const override { return true; }
};

}  // namespace

const BatchController* PedestrianController() {
  static const Pedestrian controller;
  return &controller;
}

}  // namespace Stg::control
