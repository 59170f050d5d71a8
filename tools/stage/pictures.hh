// SPDX-License-Identifier: GPL-2.0-or-later
//
// --screenshot and --record: pictures of a run without a window. What makes them is in the library
// of the window, which is loaded only when it is wanted.

#ifndef STAGE_TOOLS_STAGE_PICTURES_HH
#define STAGE_TOOLS_STAGE_PICTURES_HH

#include <memory>
#include <stdexcept>

#include "gui/offscreen/pictures.hh"
#include "stage.hh"
#include "stage/options.hh"

namespace Stg::program {

/// what() is one line that says why there are no pictures.
class PictureError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What goes wrong throws PictureError.
class PictureRun {
 public:
  /// Null if the options ask for no pictures. Throws UsageError if a file can't be written.
  static std::unique_ptr<PictureRun> Open(const Options& options);

  World* MakeWorld();
  /// To be called when the world is loaded.
  void Begin(const Options& options);
  /// To be called before the first step and after each.
  void Make();
  /// To be called when the run has come to its end, or was `interrupted`.
  void End(bool interrupted);

 private:
  explicit PictureRun(offscreen::Pictures* pictures) : pictures_(pictures) {}

  std::unique_ptr<offscreen::Pictures> pictures_;
  World* world_ = nullptr;
};

}  // namespace Stg::program

#endif
