// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/screenshots.hh"

#include <FL/gl.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

#if __has_include("gui/offscreen/png_writer.hh")
#include "gui/offscreen/png_writer.hh"
#else
namespace Stg::offscreen {
static bool WritePng(const char*, int, int, const uint8_t*, std::string* e) { *e = "none"; return false; }
}
#endif

namespace Stg::internal::window {

namespace {

/// Rows from the top; opaque, whatever is left in the buffer's fourth channel.
std::vector<uint8_t> ReadPicture(int width, int height) {
  const auto row = static_cast<size_t>(width) * 4, rows = static_cast<size_t>(height);
  std::vector<uint8_t> pixels(row * rows);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  for (size_t i = 3; i < pixels.size(); i += 4) pixels[i] = 255;
  const auto at = [&](size_t y) { return pixels.begin() + static_cast<long>(y * row); };
  for (size_t y = 0; y < rows / 2; y++) std::swap_ranges(at(y), at(y + 1), at(rows - 1 - y));
  return pixels;
}

}  // namespace

bool Screenshots::Take(int width, int height, int skip, std::string* error) {
  static unsigned next = 0;
  if (++frames_ < skip) return true;
  frames_ = 0;
  char name[32];
  std::snprintf(name, sizeof name, "stage-%06u.png", next++ % 1000000);
  const std::vector<uint8_t> pixels = ReadPicture(width, height);
  if (!offscreen::WritePng(name, width, height, pixels.data(), error)) return false;
  std::printf("Saved %s\n", name);
  std::fflush(stdout);
  return true;
}

}  // namespace Stg::internal::window
