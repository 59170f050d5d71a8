// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/offscreen/png_writer.hh"

#include <GL/gl.h>
#include <png.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string_view>

#include "files/whole_file.hh"

namespace Stg::offscreen {

namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr size_t kHeaderEnd = 8 + 25;  // length of signature and header

/// Marks images written by Stage, so that no others are replaced. It is the chunk "Software: Stage"
/// with its length and checksum.
constexpr std::string_view kMark("\0\0\0\x0etEXtSoftware\0Stage\x6d\xcd\x51\xf2", 26);

bool IsStagePicture(std::string_view beginning) {
  return beginning.starts_with(kSignature) && beginning.size() > kHeaderEnd &&
         beginning.substr(kHeaderEnd).starts_with(kMark);
}

struct FreeMemory {
  void operator()(char* memory) const { std::free(memory); }
};

/// Returns 0 or an error number.
int Encode(const Image& image, std::string* bytes) {
  png_image header;
  std::memset(&header, 0, sizeof header);
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGBA;
  header.flags = PNG_IMAGE_FLAG_FAST;
  char* memory = nullptr;
  size_t size = 0;
  std::FILE* stream = open_memstream(&memory, &size);
  if (!stream) return errno;
  const bool encoded =
      png_image_write_to_stdio(&header, stream, 0, image.pixels.data(), 0, nullptr) != 0;
  const bool closed = std::fclose(stream) == 0;
  const std::unique_ptr<char, FreeMemory> owner(memory);
  if (!encoded || !closed || size < kHeaderEnd) return ENOMEM;
  bytes->assign(memory, kHeaderEnd);
  bytes->append(kMark);
  bytes->append(memory + kHeaderEnd, size - kHeaderEnd);
  return 0;
}

}  // namespace

int WritePng(const std::string& file, const Image& image, IfExists existing) {
  std::string bytes;
  if (const int error = Encode(image, &bytes); error != 0) return error;
  return existing == IfExists::kReplace ? files::ReplaceFile(file, bytes, IsStagePicture)
                                        : files::MakeFile(file, bytes);
}

int TryWritePng(const std::string& file) { return files::TryReplaceFile(file, IsStagePicture); }

std::string PngProblem(const std::string& file, int error) {
  if (error == EISDIR) return file + " is a folder, expected the name of a file";
  if (error == EEXIST) return file + " exists and was not made by Stage; expected another name";
  return file + " can't be written: " + std::strerror(error);
}

void ReadPixels(int width, int height, Image* image) {
  image->width = width;
  image->height = height;
  const size_t row = static_cast<size_t>(width) * 4;
  image->pixels.resize(row * static_cast<size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image->pixels.data());
  // OpenGL stores the bottom row first.
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
