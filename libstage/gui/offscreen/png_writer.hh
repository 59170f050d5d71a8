// SPDX-License-Identifier: GPL-2.0-or-later
//
// Pictures into files.

#ifndef STAGE_GUI_OFFSCREEN_PNG_WRITER_HH
#define STAGE_GUI_OFFSCREEN_PNG_WRITER_HH

#include <cstdint>
#include <string>
#include <vector>

namespace Stg::offscreen {

/// Red, green, blue and opacity of each pixel, the top row first.
struct Image {
  int width = 0, height = 0;
  std::vector<uint8_t> pixels;
};

/// Writes the file whole or not at all: under another name first. False and one line that names the
/// file if that fails.
bool WritePng(const std::string& file, const Image& image, std::string* error);

/// Fills the image from the framebuffer that is bound for reading in the current context.
void ReadPixels(int width, int height, Image* image);

}  // namespace Stg::offscreen

#endif
