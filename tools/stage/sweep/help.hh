// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_SWEEP_HELP_HH
#define STAGE_TOOLS_STAGE_SWEEP_HELP_HH

#include <string>

namespace Stg::program {

/// The outputs of --help.
std::string SweepHelpText();
extern const char kMergeHelpText[];

}  // namespace Stg::program

#endif
