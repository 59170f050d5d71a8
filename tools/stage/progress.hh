// SPDX-License-Identifier: GPL-2.0-or-later
//
// A progress line on the terminal.

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

  /// Call after each round. Updates the line a few times per second.
  void Tick();

 private:
  struct Sample {
    double wall, simulated;
  };

  std::string Text(double now);

  World* last_ = nullptr;  // the world that will finish last; null: no line
  double next_;
  std::deque<Sample> samples_;  // within the last seconds
  StatusLine line_;
};

}  // namespace Stg::program

#endif
