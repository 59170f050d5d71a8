// SPDX-License-Identifier: GPL-2.0-or-later
//
// Pictures of a world without a window: what `stage --screenshot` and `--record` do. The program
// loads this from libstagegui at run time, so there is nothing here to link to.

#ifndef STAGE_GUI_OFFSCREEN_PICTURES_HH
#define STAGE_GUI_OFFSCREEN_PICTURES_HH

#include <string>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {
class World;
}

namespace Stg::offscreen {

struct Orders {
  struct Shot {
    std::string file;
    usec_t time;  ///< simulated
  };
  std::vector<Shot> shots;
  std::string film;           ///< a video, or a folder for frames: see film.hh; empty: none
  int width = 0, height = 0;  ///< pixels; 0: as large as the window's canvas would be
};

class Pictures {
 public:
  virtual ~Pictures() = default;

  /// A world whose visualizers are kept, as in a window. It is not deleted with this.
  virtual World* MakeWorld() = 0;
  /// To be called when it is loaded. False and one line if no pictures can be made of it.
  virtual bool Begin(std::string* error) = 0;
  /// Makes the pictures that are due. To be called before the first step and after each. False and
  /// one line if one could not be written.
  virtual bool Make(std::string* error) = 0;
  /// At the end of the run: makes the film whole. False and one line if that fails, or if a time
  /// for a picture was never reached though the run was not `interrupted`.
  virtual bool End(bool interrupted, std::string* error) = 0;
};

/// What libstagegui exports as `stage_make_pictures`. Null and one line if the orders can't be
/// carried out: files or folders that can't be written.
using MakePictures = Pictures* (*)(const Orders& orders, std::string* error);

}  // namespace Stg::offscreen

#endif
