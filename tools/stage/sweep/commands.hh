// SPDX-License-Identifier: GPL-2.0-or-later
//
// The program's commands for sweeps.

#ifndef STAGE_TOOLS_STAGE_SWEEP_COMMANDS_HH
#define STAGE_TOOLS_STAGE_SWEEP_COMMANDS_HH

#include <optional>

namespace Stg::program {

/// Runs argv[1] and returns the exit status if it is one of these commands. Throws UsageError and
/// std::runtime_error with a one-line message.
std::optional<int> RunSweepCommand(int argc, char* argv[]);

int Sweep(int argc, char* argv[]);
int Merge(int argc, char* argv[]);

}  // namespace Stg::program

#endif
