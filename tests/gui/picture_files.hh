// SPDX-License-Identifier: GPL-2.0-or-later
//
// Pictures, and whether they show the same. Fonts and the edges of lines differ from one machine to
// another, so that only reduced pictures are compared, with a tolerance.

#ifndef STAGE_TESTS_GUI_PICTURE_FILES_HH
#define STAGE_TESTS_GUI_PICTURE_FILES_HH

#include <cstdint>
#include <string>
#include <vector>

namespace gui_testing {

struct Picture {
  unsigned width = 0, height = 0;
  std::vector<uint8_t> rgb;  ///< rows from the top
};

/// Empty if there is no such picture.
Picture ReadPicture(const std::string& file);
bool WritePicture(const std::string& file, const Picture& picture);

/// Averages of squares of so many pixels.
Picture Reduced(const Picture& picture, unsigned factor);

/// The share of pixels that differ clearly, 0..1; 1 if the sizes do.
double Difference(const Picture& a, const Picture& b);

}  // namespace gui_testing

#endif
