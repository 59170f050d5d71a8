// SPDX-License-Identifier: GPL-2.0-or-later
//
// Films of a run: numbered pictures in a folder, or a video that the program ffmpeg makes.

#ifndef STAGE_GUI_OFFSCREEN_FILM_HH
#define STAGE_GUI_OFFSCREEN_FILM_HH

#include <memory>
#include <string>

#include "geometry/geometry.hh"
#include "gui/offscreen/png_writer.hh"

namespace Stg::offscreen {

class Film {
 public:
  /// Frames in a simulated second at most.
  static constexpr int kMostFrames = 25;

  /// The film of that name: a video if the name ends like one, a folder otherwise. Null and one
  /// line if it can't be made: what is there already, or can't be written, is refused.
  static std::unique_ptr<Film> Open(const std::string& name, std::string* error);
  virtual ~Film() = default;
  Film() = default;
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  /// Whether a frame is due at this simulated time.
  bool IsDue(usec_t now) const { return now >= next_; }
  /// Takes the next frame, of a world whose steps take that long. False and one line if it can't be
  /// written.
  bool Add(const Image& image, usec_t now, usec_t step, std::string* error);
  /// Makes the film whole. False and one line if that failed; then nothing is left of a video.
  virtual bool Finish(std::string* error) = 0;

 protected:
  /// `frames_per_second`: so that the film is as quick as the simulated world.
  virtual bool Write(const Image& image, double frames_per_second, std::string* error) = 0;

 private:
  usec_t next_ = 0;
};

/// Pictures stage-000000.png and so on. The folder is made if there is none; one that has frames
/// already is refused.
class FrameFolder : public Film {
 public:
  bool Open(const std::string& folder, std::string* error);
  bool Finish(std::string*) override { return true; }

 protected:
  bool Write(const Image& image, double frames_per_second, std::string* error) override;

 private:
  std::string folder_;
  unsigned frames_ = 0;
};

}  // namespace Stg::offscreen

#endif
