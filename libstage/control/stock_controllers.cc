// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/stock_controllers.hh"

#include "control/stock_list.hh"

namespace Stg::control {

std::vector<std::pair<std::string, const BatchController*>> StockControllers() {
  return {{"stage/behaviour", BehaviourController()},
          {"stage/disperse", DisperseController()},
          {"stage/goal", GoalController()},
          {"stage/orca", OrcaController()},
          {"stage/pedestrian", PedestrianController()},
          {"stage/wander", WanderController()}};
}

bool IsStock(const BatchController* controller) {
  return controller == BehaviourController() || controller == DisperseController() ||
         controller == GoalController() || controller == OrcaController() ||
         controller == PedestrianController() || controller == WanderController();
}

const StockParameters* StockParametersOf(const BatchController* controller,
                                         const ControlledRobot& robot) {
  return IsStock(controller) ? static_cast<const StockParameters*>(robot.parameters.get())
                             : nullptr;
}

}  // namespace Stg::control
