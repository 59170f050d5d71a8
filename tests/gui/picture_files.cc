// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/picture_files.hh"

#include <png.h>

#include <cstdlib>
#include <cstring>

namespace gui_testing {

namespace {
constexpr int kClearly = 40;  // of 255, in any channel
}

Picture ReadPicture(const std::string& file) {
  Picture picture;
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, file.c_str())) return picture;
  image.format = PNG_FORMAT_RGB;
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr)) return Picture();
  picture.width = image.width;
  picture.height = image.height;
  return picture;
}

bool WritePicture(const std::string& file, const Picture& picture) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = picture.width;
  image.height = picture.height;
  image.format = PNG_FORMAT_RGB;
  return png_image_write_to_file(&image, file.c_str(), 0, picture.rgb.data(), 0, nullptr) != 0;
}

Picture Reduced(const Picture& picture, unsigned factor) {
  Picture small;
  small.width = picture.width / factor;
  small.height = picture.height / factor;
  for (unsigned y = 0; y < small.height; y++)
    for (unsigned x = 0; x < small.width; x++)
      for (unsigned c = 0; c < 3; c++) {
        unsigned sum = 0;
        for (unsigned j = 0; j < factor; j++)
          for (unsigned i = 0; i < factor; i++)
            sum += picture.rgb[((y * factor + j) * picture.width + x * factor + i) * 3 + c];
        small.rgb.push_back(static_cast<uint8_t>(sum / (factor * factor)));
      }
  return small;
}

double Difference(const Picture& a, const Picture& b) {
  if (a.width != b.width || a.height != b.height || a.rgb.empty()) return 1;
  size_t different = 0;
  for (size_t i = 0; i < a.rgb.size(); i += 3)
    for (size_t c = 0; c < 3; c++)
      if (std::abs(a.rgb[i + c] - b.rgb[i + c]) > kClearly) {
        different++;
        break;
      }
  return static_cast<double>(different) * 3 / static_cast<double>(a.rgb.size());
}

}  // namespace gui_testing
