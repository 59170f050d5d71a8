// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/screenshots.hh"

#include <cstdio>

#include "gui/offscreen/png_writer.hh"

namespace Stg::internal::window {

bool Screenshots::Take(int width, int height, int skip, std::string* error) {
  static unsigned next = 0;
  if (++frames_ < skip) return true;
  frames_ = 0;
  char name[32];
  std::snprintf(name, sizeof name, "stage-%06u.png", next++ % 1000000);
  offscreen::Image image;
  offscreen::ReadPixels(width, height, &image);
  if (!offscreen::WritePng(name, image, error)) return false;
  std::printf("Saved %s\n", name);
  std::fflush(stdout);
  return true;
}

}  // namespace Stg::internal::window
