// SPDX-License-Identifier: GPL-2.0-or-later
//
// A video file. Frames go to the program ffmpeg, which knows by the name's end what to make of
// them. The file gets its name when it is whole.

#ifndef STAGE_GUI_OFFSCREEN_VIDEO_HH
#define STAGE_GUI_OFFSCREEN_VIDEO_HH

#include <sys/types.h>

#include <string>

#include "gui/offscreen/film.hh"

namespace Stg::offscreen {

/// Whether a name ends like a video's: ".mp4" and such.
bool IsVideoName(const std::string& name);

class Video : public Film {
 public:
  ~Video() override;

  /// False and one line if there is no ffmpeg, or if the file exists or can't be written.
  bool Open(const std::string& file, std::string* error);
  bool Finish(std::string* error) override;

 protected:
  bool Write(const Image& image, double frames_per_second, std::string* error) override;

 private:
  bool Start(const Image& image, double frames_per_second, std::string* error);
  bool End(std::string* error);
  bool Publish(std::string* error);
  std::string LastComplaint() const;

  std::string file_, program_;
  std::string unfinished_;  // the file until it is whole; empty: there is none
  int frames_ = -1;         // ffmpeg's standard input
  int complaints_ = -1;     // its standard error, a file without a name
  pid_t process_ = -1;
};

}  // namespace Stg::offscreen

#endif
