// SPDX-License-Identifier: GPL-2.0-or-later
//
// The window, which is in a library of its own and loaded only when it is wanted.

#ifndef STAGE_TOOLS_STAGE_WINDOW_HH
#define STAGE_TOOLS_STAGE_WINDOW_HH

#include <stdexcept>
#include <string>

#include "stage.hh"
#include "stage/options.hh"
#include "stage/replay.hh"

namespace Stg::program {

/// The window can't be had though there is a display; what() says why. With the status to exit
/// with.
class WindowError : public std::runtime_error {
 public:
  WindowError(const std::string& text, int exit_status)
      : std::runtime_error(text), status(exit_status) {}
  const int status;
};

/// A world with a window, if the options and the machine are for one. Null otherwise, with a line
/// on standard error if it was wanted: then the run goes on without. Throws WindowError.
/// `replay`: what the window shows, or null.
World* OpenWindow(const Options& options, ReplayRun* replay);

/// Runs the world until its window is closed, all is to end, or a signal comes.
void RunWindow(World* world);

}  // namespace Stg::program

#endif
