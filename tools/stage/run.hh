// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads and steps worlds.

#ifndef STAGE_TOOLS_STAGE_RUN_HH
#define STAGE_TOOLS_STAGE_RUN_HH

#include <string>
#include <vector>

#include "stage.hh"
#include "stage/options.hh"
#include "stage/pictures.hh"
#include "world/step_pacer.hh"
#include "world/world_handle.hh"

namespace Stg::program {

class SnapshotSaver;

struct LoadedWorld {
  World* world;
  WorldHandle handle;  ///< handle of `world`
  std::string file;    ///< as on the command line
  /// Time spent in steps, without loading and waiting. With a window: from start to end.
  double wall_seconds = 0;
  StepPacer pacer;
};

/// Loads the world files in order. Returns 0, or the exit status after reporting an error.
/// `with_window` is the world to use for the first file, or null.
int LoadWorlds(const Options& options, std::vector<LoadedWorld>* worlds,
               World* with_window = nullptr);

/// Steps all worlds in turn until all are done or a signal comes, or until the window is closed.
/// `pictures` and `saver` work on the only world, and may be null. Throws PictureError, and
/// std::runtime_error if a file cannot be written.
void RunWorlds(const Options& options, std::vector<LoadedWorld>* worlds,
               PictureRun* pictures = nullptr, SnapshotSaver* saver = nullptr);

}  // namespace Stg::program

#endif
