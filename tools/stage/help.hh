// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_HELP_HH
#define STAGE_TOOLS_STAGE_HELP_HH

namespace Stg::program {

/// The output of --help.
extern const char kHelpText[];

}  // namespace Stg::program

#endif
