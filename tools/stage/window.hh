// SPDX-License-Identifier: GPL-2.0-or-later
//
// Opens the window. It is in a separate library that is loaded on demand.

#ifndef STAGE_TOOLS_STAGE_WINDOW_HH
#define STAGE_TOOLS_STAGE_WINDOW_HH

#include <stdexcept>
#include <string>

#include "stage.hh"
#include "stage/options.hh"
#include "stage/replay.hh"

namespace Stg::program {

/// There is a display, but no window can be opened; what() says why. Carries the exit status.
class WindowError : public std::runtime_error {
 public:
  WindowError(const std::string& text, int exit_status)
      : std::runtime_error(text), status(exit_status) {}
  const int status;
};

/// Returns a world with a window if the options and the machine allow one. Otherwise returns null,
/// after a line on standard error if a window was wanted. `replay`: the replay to show, or null.
/// Throws WindowError.
World* OpenWindow(const Options& options, ReplayRun* replay);

/// Runs the world until its window is closed, all worlds are to end, or a signal comes.
void RunWindow(World* world);

}  // namespace Stg::program

#endif
