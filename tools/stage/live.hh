// SPDX-License-Identifier: GPL-2.0-or-later
//
// --live and --foxglove: shows a run in a browser or Foxglove; the Python module stagesim.live.

#ifndef STAGE_TOOLS_STAGE_LIVE_HH
#define STAGE_TOOLS_STAGE_LIVE_HH

#include "stage/options.hh"

namespace Stg::program {

/// Replaces this process by that module with the given options. Throws UsageError for options that
/// the module does not support, and everything that BecomePythonModule() throws.
[[noreturn]] void ShowLive(const Options& options);

}  // namespace Stg::program

#endif
