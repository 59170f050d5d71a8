// SPDX-License-Identifier: GPL-2.0-or-later
//
// A video file. ffmpeg encodes the frames and chooses the format by the file's extension. The file
// gets its final name when it is complete.

#ifndef STAGE_GUI_OFFSCREEN_VIDEO_HH
#define STAGE_GUI_OFFSCREEN_VIDEO_HH

#include <sys/types.h>

#include <string>

#include "gui/offscreen/film.hh"

namespace Stg::offscreen {

/// True if the name has a video's extension, such as ".mp4".
bool IsVideoName(const std::string& name);

class Video : public Film {
 public:
  ~Video() override;

  /// Checks that a film can be made; the first frame makes the file. Returns false and a one-line
  /// reason if ffmpeg is missing or the file exists or is unwritable.
  bool Open(const std::string& file, std::string* error);
  bool Finish(std::string* error) override;

 protected:
  bool Write(const Image& image, double frames_per_second, std::string* error) override;

 private:
  bool Start(const Image& image, double frames_per_second, std::string* error);
  bool End(std::string* error);
  bool Publish(std::string* error);
  std::string LastErrorLine() const;

  std::string file_, program_;
  std::string temporary_name_;  // name of the incomplete file; empty: none
  int frames_ = -1;             // ffmpeg's standard input
  int error_file_ = -1;         // ffmpeg's standard error, an anonymous file
  pid_t process_ = -1;
};

}  // namespace Stg::offscreen

#endif
