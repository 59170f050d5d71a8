// SPDX-License-Identifier: GPL-2.0-or-later
//
// PNG files.

#ifndef STAGE_GUI_OFFSCREEN_PNG_WRITER_HH
#define STAGE_GUI_OFFSCREEN_PNG_WRITER_HH

#include <cstdint>
#include <string>
#include <vector>

namespace Stg::offscreen {

/// Red, green, blue and opacity of each pixel, top row first.
struct Image {
  int width = 0, height = 0;
  std::vector<uint8_t> pixels;
};

/// Handling of an existing image by Stage: replace it, or fail. Other files are never replaced.
enum class IfExists { kReplace, kKeep };

/// Writes the file completely or not at all. Returns 0 or an error number; EEXIST means that a
/// file of this name exists and must not be replaced.
int WritePng(const std::string& file, const Image& image, IfExists existing);
/// Returns what WritePng() would return with kReplace, without writing anything.
int TryWritePng(const std::string& file);
/// Describes an error in one line that names the file.
std::string PngProblem(const std::string& file, int error);

/// Fills the image from the framebuffer bound for reading.
void ReadPixels(int width, int height, Image* image);

}  // namespace Stg::offscreen

#endif
