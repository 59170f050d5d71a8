// SPDX-License-Identifier: GPL-2.0-or-later
//
// The line on a terminal that says how far a run is.

#ifndef STAGE_TOOLS_STAGE_PROGRESS_HH
#define STAGE_TOOLS_STAGE_PROGRESS_HH

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "stage/run.hh"
#include "stage/status_line.hh"

namespace Stg::program {

class Progress {
 public:
  /// `wanted` unset: only if standard error is a terminal, the end is known and no clock is shown.
  Progress(std::optional<bool> wanted, const std::vector<LoadedWorld>& worlds);

  /// To be called after each round. Prints a few times a second.
  void Tick();

 private:
  struct Sample {
    double wall, simulated;
  };

  std::string Text(double now);

  World* last_ = nullptr;  // the world that will be done last; null: nothing is shown
  double next_;
  std::deque<Sample> samples_;  // of the last seconds
  StatusLine line_;
};

}  // namespace Stg::program

#endif
