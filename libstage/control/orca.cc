// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/orca: goes to a place and evades others by reciprocal collision
// avoidance. See docs/controllers.md.

#include <memory>
#include <utility>

#include "control/company_setup.hh"
#include "control/route_setup.hh"
#include "control/stock_batch.hh"
#include "control/stock_list.hh"
#include "kernels/row_behaviour.h"

namespace Stg::control {

namespace {

class Orca : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    auto parameters = std::make_shared<StockParameters>();
    parameters->record.kind = ROW_ORCA;
    row_orca_t& rule = parameters->record.rule.orca;
    rule = {.route = {},
            .speed = 0.7,
            .tolerance = 0.1,
            .turn = 3.0,
            .radius = RadiusOf(setup->robot()),
            .interval = IntervalOf(setup->robot()),
            .evader = {}};
    std::vector<ControllerNumber> numbers = {
        {"speed", &rule.speed, 0, 1000},
        {"tolerance", &rule.tolerance, kLeastDivisor, 1000},
        {"turn", &rule.turn, 0, 1000},
        {"radius", &rule.radius, 0, 1000},
    };
    for (const ControllerNumber& number : EvaderNumbers(&rule.evader, "time"))
      numbers.push_back(number);
    ReadRoute(*setup, std::move(numbers), &rule.route);
    RequireWhole("neighbours", rule.evader.most);
    UseRangers(setup, parameters.get());
    return parameters;
  }

  void Step(const ControllerBatch& batch) const override {
    DriveAllByReadings(batch, [](const InBatch& at, const double* ranges, row_planar_t* command) {
      const row_company_t all = at.all();
      row_go_reciprocally(&at.parameters().record.rule.orca, at.parameters().layout->record(),
                          ranges, &all, at.batch.time[at.world],
                          at.batch.memory + ROW_ROUTE_SIZE * at.index(), command);
    });
  }

  size_t memory_size() const override { return ROW_ROUTE_SIZE; }
  bool needs_velocities() const override { return true; }
};

}  // namespace

const BatchController* OrcaController() {
  static const Orca controller;
  return &controller;
}

}  // namespace Stg::control
