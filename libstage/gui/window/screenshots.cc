// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/screenshots.hh"

#include <sys/stat.h>

#include <cerrno>
#include <cstdio>

#include "gui/offscreen/png_writer.hh"
#include "messages/report.hh"

namespace Stg::internal::window {

bool Screenshots::Take(int width, int height, int skip, std::string* error) {
  static unsigned next = 0;
  if (++frames_ < skip) return true;
  frames_ = 0;
  offscreen::Image image;
  offscreen::ReadPixels(width, height, &image);
  char name[32];
  int problem = 0;
  do {
    std::snprintf(name, sizeof name, "stage-%06u.png", next++);
    struct stat found;
    problem = lstat(name, &found) == 0
                  ? EEXIST
                  : offscreen::WritePng(name, image, offscreen::IfExists::kKeep);
  } while (problem == EEXIST);
  if (problem != 0) {
    *error = offscreen::PngProblem(name, problem);
    return false;
  }
  messages::Progress(std::string("Saved ") + name);
  return true;
}

}  // namespace Stg::internal::window
