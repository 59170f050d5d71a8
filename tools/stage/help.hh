// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_HELP_HH
#define STAGE_TOOLS_STAGE_HELP_HH

namespace Stg::program {

/// What --help prints.
extern const char kHelpText[];

}  // namespace Stg::program

#endif
