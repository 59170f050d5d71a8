// SPDX-License-Identifier: GPL-2.0-or-later
//
// The program's commands for maps: `stage import` and `stage export`.

#ifndef STAGE_TOOLS_STAGE_MAP_COMMANDS_HH
#define STAGE_TOOLS_STAGE_MAP_COMMANDS_HH

namespace Stg::program {

/// Replaces this process by the Python module stagesim.maps if argv[1] is one of its commands.
/// Throws std::runtime_error if there is no interpreter.
void BecomeMapCommand(int argc, char* argv[]);

}  // namespace Stg::program

#endif
