// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loading and stepping worlds.

#ifndef STAGE_TOOLS_STAGE_RUN_HH
#define STAGE_TOOLS_STAGE_RUN_HH

#include <string>
#include <vector>

#include "stage.hh"
#include "stage/options.hh"
#include "stage/pictures.hh"
#include "world/world_handle.hh"

namespace Stg::program {

class SnapshotSaver;

/// Keeps a world's steps to the pace that its `speedup` asks for.
class Pacer {
 public:
  /// Sleeps until the world's next step is due. False if a signal came.
  bool Wait(const World& world);

 private:
  double due_ = -1;  // of the last step; negative: there was none
};

struct LoadedWorld {
  World* world;
  WorldHandle handle;  ///< of it
  std::string file;    ///< as on the command line
  /// Spent in steps: without loading and waiting. With a window: from the start to the end.
  double wall_seconds = 0;
  Pacer pacer;
};

/// Loads the world files, in their order. Returns 0, or the status to exit with: then something is
/// wrong with one of them, and was reported. `with_window`: the world for the first of them, if it
/// has to be this one.
int LoadWorlds(const Options& options, std::vector<LoadedWorld>* worlds,
               World* with_window = nullptr);

/// Steps all worlds in turn until all are done, or a signal comes; one with a window until that is
/// closed. `pictures`: what makes pictures of the only world, or null; `saver`: the
/// same for a snapshot. Throws PictureError, and std::runtime_error if a file can't be written.
void RunWorlds(const Options& options, std::vector<LoadedWorld>* worlds,
               PictureRun* pictures = nullptr, SnapshotSaver* saver = nullptr);

}  // namespace Stg::program

#endif
