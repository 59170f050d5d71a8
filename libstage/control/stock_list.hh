// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controllers, each in a file of its own.

#ifndef STAGE_CONTROL_STOCK_LIST_HH
#define STAGE_CONTROL_STOCK_LIST_HH

#include "control/batch_controller.hh"

namespace Stg::control {

const BatchController* BehaviourController();
const BatchController* DisperseController();
const BatchController* GoalController();
const BatchController* OrcaController();
const BatchController* PedestrianController();
const BatchController* WanderController();

}  // namespace Stg::control

#endif
