// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/wander: drives about at random and avoids obstacles.

#ifndef STAGE_CONTROL_WANDER_HH
#define STAGE_CONTROL_WANDER_HH

#include "control/batch_controller.hh"
#include "kernels/row_control.h"

namespace Stg::control {

struct WanderParameters : ControllerParameters {
  row_wander_t rule{};
};

const BatchController* WanderController();

}  // namespace Stg::control

#endif
