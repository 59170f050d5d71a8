// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/stock_controllers.hh"

#include <algorithm>

#include "control/stock_list.hh"

namespace Stg::control {

std::vector<std::pair<std::string, const BatchController*>> StockControllers() {
  return {{"stage/disperse", DisperseController()},
          {"stage/goal", GoalController()},
          {"stage/pedestrian", PedestrianController()},
          {"stage/wander", WanderController()}};
}

const StockParameters* StockParametersOf(const BatchController* controller,
                                         const ControlledRobot& robot) {
  for (const auto& [name, stock] : StockControllers())
    if (stock == controller) return static_cast<const StockParameters*>(robot.parameters.get());
  return nullptr;
}

}  // namespace Stg::control
