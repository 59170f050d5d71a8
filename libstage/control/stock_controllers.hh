// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controllers: batch controllers whose rules are kernels/row_control.h, so that rows
// on devices have them as well.

#ifndef STAGE_CONTROL_STOCK_CONTROLLERS_HH
#define STAGE_CONTROL_STOCK_CONTROLLERS_HH

#include <string>
#include <utility>
#include <vector>

#include "control/batch_controller.hh"

namespace Stg::control {

/// Names and controllers.
std::vector<std::pair<std::string, const BatchController*>> StockControllers();

}  // namespace Stg::control

#endif
