// SPDX-License-Identifier: GPL-2.0-or-later
//
// Frames of a film: numbered pictures in a folder.

#ifndef STAGE_GUI_OFFSCREEN_FILM_HH
#define STAGE_GUI_OFFSCREEN_FILM_HH

#include <string>

#include "geometry/geometry.hh"
#include "gui/offscreen/png_writer.hh"

namespace Stg::offscreen {

class Film {
 public:
  /// Frames in a simulated second at most.
  static constexpr int kMostFrames = 25;

  /// The folder is made if there is none; one that has frames already, or can't be written, is
  /// refused: false and one line.
  bool Open(const std::string& folder, std::string* error);
  /// Whether a frame is due at this simulated time.
  bool IsDue(usec_t now) const;
  /// Writes the next frame, stage-000000.png and so on.
  bool Add(const Image& image, usec_t now, std::string* error);
  unsigned frames() const { return frames_; }

 private:
  std::string folder_;
  unsigned frames_ = 0;
  usec_t next_ = 0;
};

}  // namespace Stg::offscreen

#endif
