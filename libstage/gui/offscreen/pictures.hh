// SPDX-License-Identifier: GPL-2.0-or-later
//
// Images of a world without a window, for `stage --screenshot` and `--record`. The program loads
// this from libstagegui at run time, so nothing here needs linking.

#ifndef STAGE_GUI_OFFSCREEN_PICTURES_HH
#define STAGE_GUI_OFFSCREEN_PICTURES_HH

#include <string>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {
class World;
}

namespace Stg::offscreen {

struct PictureOptions {
  struct Shot {
    std::string file;
    usec_t time;  ///< simulated time of the image
  };
  std::vector<Shot> shots;
  std::string film;           ///< video file or folder for frames, see film.hh; empty: none
  int width = 0, height = 0;  ///< pixels; 0: the size of the window's canvas
};

class Pictures {
 public:
  virtual ~Pictures() = default;

  /// Makes a world that keeps its visualizers, as a window does. The caller owns it.
  virtual World* MakeWorld() = 0;
  /// Call when the world is loaded. Returns false and a one-line reason if no images can be made.
  virtual bool Begin(std::string* error) = 0;
  /// Makes the images that are due. Call before the first step and after each step. Returns false
  /// and a one-line reason if one cannot be written.
  virtual bool Make(std::string* error) = 0;
  /// Completes the film at the end of the run. Returns false and a one-line reason if that fails,
  /// or if a requested time was not reached although the run was not `interrupted`.
  virtual bool End(bool interrupted, std::string* error) = 0;
};

/// Type of `stage_make_pictures`, which libstagegui exports. Returns null and a one-line reason if
/// a file or folder cannot be written.
using MakePictures = Pictures* (*)(const PictureOptions& picture_options, std::string* error);

}  // namespace Stg::offscreen

#endif
