// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arguments of the controllers that evade other robots.

#ifndef STAGE_CONTROL_COMPANY_SETUP_HH
#define STAGE_CONTROL_COMPANY_SETUP_HH

#include <memory>
#include <vector>

#include "control/batch_controller.hh"
#include "control/stock_controllers.hh"
#include "kernels/row_orca.h"

namespace Stg::control {

constexpr double kFar = 1e9;            ///< m: greatest coordinate of a goal
constexpr double kLeastDivisor = 1e-3;  ///< of what rules divide by

/// Half of the diagonal of a robot's size, m.
double RadiusOf(const ModelPosition& robot);
/// Time between the updates of a robot, s.
double IntervalOf(const ModelPosition& robot);
/// Uses all rangers that no other controller uses.
void UseRangers(ControllerSetup* setup, StockParameters* parameters);
/// The numbers of social forces, with their defaults.
std::vector<ControllerNumber> WalkerNumbers(row_walker_t* rule, const ModelPosition& robot);
/// The numbers of reciprocal avoidance, with their defaults.
std::vector<ControllerNumber> EvaderNumbers(row_evader_t* rule, const char* time);
/// Throws if a number is not whole.
void RequireWhole(const char* name, double value);

}  // namespace Stg::control

#endif
