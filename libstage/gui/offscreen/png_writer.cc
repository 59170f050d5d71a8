// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/offscreen/png_writer.hh"

#include <GL/gl.h>
#include <png.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace Stg::offscreen {

bool WritePng(const std::string& file, const Image& image, std::string* error) {
  const std::string draft = file + "." + std::to_string(getpid()) + ".part";
  std::FILE* out = std::fopen(draft.c_str(), "wb");
  if (!out) {
    *error = file + " can't be written: " + std::strerror(errno);
    return false;
  }
  png_image header;
  std::memset(&header, 0, sizeof header);
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGBA;
  header.flags = PNG_IMAGE_FLAG_FAST;
  errno = 0;
  const bool encoded =
      png_image_write_to_stdio(&header, out, 0, image.pixels.data(), 0, nullptr) != 0;
  const int reason = errno;  // libpng only knows that writing has failed
  const bool closed = std::fclose(out) == 0;
  if (encoded && closed && std::rename(draft.c_str(), file.c_str()) == 0) return true;
  const char* what = encoded ? std::strerror(errno) : header.message;
  *error = file + " can't be written: " + (!encoded && reason ? std::strerror(reason) : what);
  std::remove(draft.c_str());
  return false;
}

void ReadPixels(int width, int height, Image* image) {
  image->width = width;
  image->height = height;
  const size_t row = static_cast<size_t>(width) * 4;
  image->pixels.resize(row * static_cast<size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image->pixels.data());
  // OpenGL begins at the bottom.
  for (size_t top = 0, bottom = static_cast<size_t>(height); top + 1 < bottom; top++) {
    bottom--;
    const auto begin = image->pixels.begin();
    std::swap_ranges(begin + static_cast<std::ptrdiff_t>(top * row),
                     begin + static_cast<std::ptrdiff_t>((top + 1) * row),
                     begin + static_cast<std::ptrdiff_t>(bottom * row));
  }
  for (size_t i = 3; i < image->pixels.size(); i += 4) image->pixels[i] = 255;
}

}  // namespace Stg::offscreen
