// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arguments of the controllers that go to several goals, and in groups.

#ifndef STAGE_CONTROL_ROUTE_SETUP_HH
#define STAGE_CONTROL_ROUTE_SETUP_HH

#include <vector>

#include "control/batch_controller.hh"
#include "kernels/row_control.h"

namespace Stg::control {

/// Reads all arguments of a robot: these numbers and its goals, which are either x=NUMBER y=NUMBER
/// or goals=X,Y,X,Y and so on.
void ReadRoute(const ControllerSetup& setup, std::vector<ControllerNumber> numbers,
               row_route_t* route);
/// The numbers of groups, with their defaults: a robot without a group.
std::vector<ControllerNumber> GroupNumbers(row_group_t* group);
/// Throws if a robot is not a member of its group.
void CheckGroup(const row_group_t& group);

}  // namespace Stg::control

#endif
