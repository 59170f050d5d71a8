// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_SWEEP_HELP_HH
#define STAGE_TOOLS_STAGE_SWEEP_HELP_HH

namespace Stg::program {

/// The outputs of --help.
extern const char kSweepHelpText[];
extern const char kMergeHelpText[];

}  // namespace Stg::program

#endif
