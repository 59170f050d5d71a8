// SPDX-License-Identifier: GPL-2.0-or-later
//
// Comparison of pictures. Fonts and the edges of lines differ between machines, so reduced pictures
// are compared, with a tolerance.

#ifndef STAGE_TESTS_GUI_PICTURE_FILES_HH
#define STAGE_TESTS_GUI_PICTURE_FILES_HH

#include <cstdint>
#include <string>
#include <vector>

namespace gui_testing {

struct Picture {
  unsigned width = 0, height = 0;
  std::vector<uint8_t> rgb;  ///< rows from top to bottom, 3 bytes per pixel
};

/// Reads a PNG file; empty if it can't be read.
Picture ReadPicture(const std::string& file);
bool WritePicture(const std::string& file, const Picture& picture);

/// Averages of squares of `factor` x `factor` pixels.
Picture Reduced(const Picture& picture, unsigned factor);

/// Fraction of pixels that differ clearly, 0..1; 1 if the sizes differ.
double Difference(const Picture& a, const Picture& b);

}  // namespace gui_testing

#endif
