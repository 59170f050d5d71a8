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

/// What may be at the place already: a picture that was written by these functions, or nothing.
enum class Existing { kReplace, kKeep };

/// Writes the file whole or not at all. 0, or the number of an error; EEXIST: there is something
/// else.
int WritePng(const std::string& file, const Image& image, Existing existing);
/// What writing would come to, if it is to replace. Leaves no trace.
int TryWritePng(const std::string& file);
/// One line that names the file.
std::string PngProblem(const std::string& file, int error);

/// Fills the image from the framebuffer that is bound for reading in the current context.
void ReadPixels(int width, int height, Image* image);

}  // namespace Stg::offscreen

#endif
