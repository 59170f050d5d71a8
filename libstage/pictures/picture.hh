// SPDX-License-Identifier: GPL-2.0-or-later
// Reads picture files (PNG, JPEG, GIF, BMP, PBM, PGM, PPM) into bitmaps of solid pixels.

#ifndef STAGE_PICTURES_PICTURE_HH
#define STAGE_PICTURES_PICTURE_HH

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace Stg {
namespace picture {

/// Limits on picture files, far above what maps need: a building of a kilometre at 0.1 m per pixel
/// is 10000 pixels long. A file at these limits takes less than a second and less than 100 MB.
inline constexpr std::uint64_t kMaxSide = 32768;               // pixels per side
inline constexpr std::uint64_t kMaxPixels = 100'000'000;       // 10000 x 10000
inline constexpr std::uint64_t kMaxSampleBytes = 110'000'000;  // all samples, decoded
inline constexpr std::uint64_t kMaxFileBytes = 300'000'000;

/// The solid pixels of a picture. Rows are counted from the top, columns from the left.
class Bitmap {
 public:
  Bitmap() = default;
  /// Starts without solid pixels.
  Bitmap(int width, int height)
      : width_(width),
        height_(height),
        words_per_row_((static_cast<std::size_t>(width) + 63) / 64),
        words_(words_per_row_ * static_cast<std::size_t>(height)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool IsSolid(std::size_t x, std::size_t y) const { return (Row(y)[x / 64] >> (x % 64) & 1) != 0; }
  void MakeSolid(std::size_t x, std::size_t y) { Row(y)[x / 64] |= std::uint64_t{1} << (x % 64); }

  /// 64 pixels per word, the leftmost in the lowest bit. Bits past the width are 0.
  const std::uint64_t* Row(std::size_t y) const { return words_.data() + y * words_per_row_; }
  std::uint64_t* Row(std::size_t y) { return words_.data() + y * words_per_row_; }
  std::size_t words_per_row() const { return words_per_row_; }

 private:
  int width_ = 0;
  int height_ = 0;
  std::size_t words_per_row_ = 0;
  std::vector<std::uint64_t> words_;
};

/// Reads the picture file at `path`. A pixel is solid if its sample is at most `threshold`. The
/// sample is the grey value, or the red channel of a colour picture. Palettes are applied first,
/// 16-bit samples are truncated to the high byte, transparency is ignored.
/// Throws LoadError (exit status 255, one line "PATH: reason") if the file is missing, not a
/// regular file, not of an accepted format, damaged, truncated, or larger than the limits above. A
/// file too short for the declared picture is rejected before memory is allocated.
Bitmap Load(const std::string& path, std::uint8_t threshold = 127);

/// Like Load(), for a file in memory. Errors refer to it as `name`.
Bitmap LoadFromMemory(const void* data, std::size_t size, const std::string& name,
                      std::uint8_t threshold = 127);

/// The samples of a picture with 8 bits each, row by row from the top.
struct Samples {
  int width = 0, height = 0;
  int channels = 0;  ///< of a pixel, such as 1 for grey and 4 for red, green, blue and opacity
  std::vector<std::uint8_t> values;
};

/// Reads the samples of a PNG or PGM file. Throws LoadError like Load().
Samples LoadSamples(const std::string& path);
/// Like LoadSamples(), for a file in memory. Errors refer to it as `name`.
Samples LoadSamplesFromMemory(const void* data, std::size_t size, const std::string& name);

}  // namespace picture
}  // namespace Stg

#endif  // STAGE_PICTURES_PICTURE_HH
