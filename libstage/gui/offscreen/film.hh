// SPDX-License-Identifier: GPL-2.0-or-later
//
// Recordings of a run: numbered images in a folder, or a video encoded by ffmpeg.

#ifndef STAGE_GUI_OFFSCREEN_FILM_HH
#define STAGE_GUI_OFFSCREEN_FILM_HH

#include <memory>
#include <string>

#include "geometry/geometry.hh"
#include "gui/offscreen/png_writer.hh"

namespace Stg::offscreen {

class Film {
 public:
  /// Maximum number of frames per simulated second.
  static constexpr int kMaxFrameRate = 25;

  /// Opens a film: a video if the name has a video's extension, otherwise a folder. Returns null
  /// and a one-line reason if it exists already or cannot be written.
  static std::unique_ptr<Film> Open(const std::string& name, std::string* error);
  virtual ~Film() = default;
  Film() = default;
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  /// True if a frame is due at this simulated time.
  bool IsDue(usec_t now) const { return now >= next_; }
  /// Adds the next frame; `step` is the duration of the world's steps. Returns false and a one-line
  /// reason if it cannot be written.
  bool Add(const Image& image, usec_t now, usec_t step, std::string* error);
  /// Completes the film. On failure, deletes a video and returns false and a one-line reason.
  virtual bool Finish(std::string* error) = 0;

 protected:
  /// Writes one frame. `frames_per_second` makes the film run at simulated speed.
  virtual bool Write(const Image& image, double frames_per_second, std::string* error) = 0;

 private:
  usec_t next_ = 0;
};

/// Images named stage-000000.png and so on. Creates the folder if necessary, and rejects one that
/// already has frames.
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
