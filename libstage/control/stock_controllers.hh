// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controllers: batch controllers whose rules are kernels/row_control.h, so that rows
// on devices have them as well.

#ifndef STAGE_CONTROL_STOCK_CONTROLLERS_HH
#define STAGE_CONTROL_STOCK_CONTROLLERS_HH

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "control/batch_controller.hh"
#include "control/ray_layout.hh"
#include "kernels/row_control.h"

namespace Stg::control {

/// The parameters of a built-in controller for a robot.
struct StockParameters : ControllerParameters {
  row_control_t record{};                   ///< kind and rule; the rest is for devices
  double horizon = 0;                       ///< m: of the layout
  std::shared_ptr<const RayLayout> layout;  ///< null for controllers without sectors and points
};

/// Names and controllers.
std::vector<std::pair<std::string, const BatchController*>> StockControllers();
bool IsStock(const BatchController* controller);
/// The parameters if the controller is a built-in one, otherwise null.
const StockParameters* StockParametersOf(const BatchController* controller,
                                         const ControlledRobot& robot);

}  // namespace Stg::control

#endif
