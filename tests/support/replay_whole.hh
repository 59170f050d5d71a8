// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replays a log that may be damaged or malicious.

#ifndef STAGE_TESTS_REPLAY_WHOLE_HH
#define STAGE_TESTS_REPLAY_WHOLE_HH

#include <cstdio>
#include <cstdlib>
#include <string>

#include "recording/replay.hh"
#include "stage.hh"

namespace Stg::test {

/// Loads the log's world, makes some steps, goes to the end and back to the start. Returns early if
/// the world cannot be loaded. Throws std::runtime_error if the log is refused.
inline void ReplayWhole(const std::string& file) {
  if (!InitDone()) Init(nullptr, nullptr);
  recording::Replay replay(file);
  RunOptions options;
  options.listed = false;
  options.controllers = false;
  World world(options);
  {
    const recording::UnpackedFiles files(replay.files());
    if (!world.Load(files.world_file())) return;
  }
  replay.Attach(&world);
  for (int i = 0; i < 5; i++) world.Update();
  replay.SeekTo(replay.end());
  replay.SeekTo(0);
  if (const std::string fault = world.Validate(); !fault.empty()) {
    std::fprintf(stderr, "found %s\n", fault.c_str());
    std::abort();
  }
}

}  // namespace Stg::test

#endif
