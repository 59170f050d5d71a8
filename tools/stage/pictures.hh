// SPDX-License-Identifier: GPL-2.0-or-later
//
// --screenshot and --record: images of a run without a window. They are made by the window's
// library, which is loaded on demand.

#ifndef STAGE_TOOLS_STAGE_PICTURES_HH
#define STAGE_TOOLS_STAGE_PICTURES_HH

#include <memory>
#include <stdexcept>

#include "gui/offscreen/pictures.hh"
#include "stage.hh"
#include "stage/options.hh"

namespace Stg::program {

/// what() is one line that explains why there are no images.
class PictureError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes the images of a run. All failures throw PictureError.
class PictureRun {
 public:
  /// Returns null if the options ask for no images. Throws UsageError if a file cannot be written.
  static std::unique_ptr<PictureRun> Open(const Options& options);

  World* MakeWorld();
  /// Call when the world is loaded.
  void Begin(const Options& options);
  /// Call before the first step and after each step.
  void Make();
  /// Call at the end of the run, or when it was `interrupted`.
  void End(bool interrupted);

 private:
  explicit PictureRun(offscreen::Pictures* pictures) : pictures_(pictures) {}

  std::unique_ptr<offscreen::Pictures> pictures_;
  World* world_ = nullptr;
};

}  // namespace Stg::program

#endif
