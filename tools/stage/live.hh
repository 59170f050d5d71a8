// SPDX-License-Identifier: GPL-2.0-or-later
//
// A running world in a browser, or in Foxglove: the Python module stagesim.live.

#ifndef STAGE_TOOLS_STAGE_LIVE_HH
#define STAGE_TOOLS_STAGE_LIVE_HH

#include "stage/options.hh"

namespace Stg::program {

/// Becomes that module, with what the options say. Throws UsageError if they ask for something that
/// it does not do, and what BecomePythonModule() throws.
[[noreturn]] void ShowLive(const Options& options);

}  // namespace Stg::program

#endif
