// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/stock_controllers.hh"

#include "control/wander.hh"

namespace Stg::control {

std::vector<std::pair<std::string, const BatchController*>> StockControllers() {
  return {{"stage/wander", WanderController()}};
}

}  // namespace Stg::control
