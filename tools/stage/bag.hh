// SPDX-License-Identifier: GPL-2.0-or-later
//
// `stage bag info LOG`: prints what is in a log.

#ifndef STAGE_TOOLS_STAGE_BAG_HH
#define STAGE_TOOLS_STAGE_BAG_HH

#include <optional>

namespace Stg::program {

/// Runs `stage bag` if argv[1] says so, and returns the exit status. Throws UsageError, or
/// std::runtime_error if the file is no MCAP file or is damaged.
std::optional<int> RunBagCommand(int argc, char* argv[]);

}  // namespace Stg::program

#endif
