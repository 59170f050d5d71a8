// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/goal: drives straight to a place in the frame of the estimate, and
// stops there.

#include <limits>
#include <memory>

#include "control/stock_batch.hh"
#include "control/stock_list.hh"

namespace Stg::control {

namespace {

class Goal : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    constexpr double kFar = 1e9, kRequired = std::numeric_limits<double>::quiet_NaN();
    auto parameters = std::make_shared<StockParameters>();
    parameters->record.kind = ROW_GOAL;
    row_goal_t& rule = parameters->record.rule.goal;
    double degrees = std::numeric_limits<double>::infinity();
    rule = {kRequired, kRequired, 0, 0.4, 1.0, 0.1};
    setup->ReadNumbers({{"x", &rule.x, -kFar, kFar},
                        {"y", &rule.y, -kFar, kFar},
                        {"heading", &degrees, -360, 360},
                        {"speed", &rule.speed, 0, 1000},
                        {"turn", &rule.turn, 0, 1000},
                        {"tolerance", &rule.tolerance, 0, 1000}});
    rule.heading = degrees * (ROW_PI / 180);
    return parameters;
  }

  void Step(const ControllerBatch& batch) const override {
    DriveAll(batch, [](const InBatch& at, row_planar_t* command) {
      row_go_to_goal(&at.parameters().record.rule.goal, at.estimate(), command);
    });
  }
};

}  // namespace

const BatchController* GoalController() {
  static const Goal controller;
  return &controller;
}

}  // namespace Stg::control
