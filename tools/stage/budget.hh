// SPDX-License-Identifier: GPL-2.0-or-later
//
// --budget-ms: the number of scenarios that fit into a time on this machine.

#ifndef STAGE_TOOLS_STAGE_BUDGET_HH
#define STAGE_TOOLS_STAGE_BUDGET_HH

#include "stage/options.hh"

namespace Stg::program {

/// Prints the result and returns the exit status.
int PrintBudget(const Options& options);

}  // namespace Stg::program

#endif
