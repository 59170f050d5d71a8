// SPDX-License-Identifier: GPL-2.0-or-later
// Reads uncompressed BMP pictures of all depths. Own code, because the format is simple and no
// library reads only BMP.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "pictures/picture_reader.hh"

namespace Stg {
namespace picture {
namespace {

constexpr std::uint32_t kFileHeader = 14;  // bytes
// Header sizes in bytes: OS/2 1.x, Windows 3, OS/2 2.x, and all known variants.
constexpr std::uint32_t kCoreHeader = 12, kInfoHeader = 40, kOs2Header = 64;
constexpr std::uint32_t kHeaders[] = {kCoreHeader, kInfoHeader, 52, 56, kOs2Header, 108, 124};
constexpr std::uint32_t kNoCompression = 0, kMasks = 3, kMasksWithAlpha = 6;

// Little-endian bytes of a file.
class Bytes {
 public:
  Bytes(const Input& input, std::size_t count) : bytes_(count) {
    if (std::fread(bytes_.data(), 1, count, input.file) != count)
      Fail(input, "the file is cut short");
  }
  std::uint32_t U16(std::size_t at) const { return bytes_[at] | unsigned{bytes_[at + 1]} << 8; }
  std::uint32_t U32(std::size_t at) const { return U16(at) | U16(at + 2) << 16; }
  std::uint8_t operator[](std::size_t at) const { return bytes_[at]; }

 private:
  std::vector<std::uint8_t> bytes_;
};

class BmpReader {
 public:
  explicit BmpReader(const Input& input) : input_(input) {}

  Bitmap Read() {
    const Bytes file(input_, kFileHeader);
    ReadHeader();
    CheckHeader();
    const std::uint64_t row_bytes = (std::uint64_t{width_} * depth_ + 31) / 32 * 4;
    Bitmap bitmap = MakeBitmap(input_, width_, height_, depth_, kFileHeader + row_bytes * height_);
    if (depth_ <= 8) ReadPalette();
    if (std::fseek(input_.file, static_cast<long>(file.U32(10)), SEEK_SET) != 0)
      Fail(input_, "the file is cut short");
    for (std::uint32_t row = 0; row < height_; ++row) {
      const Bytes bytes(input_, static_cast<std::size_t>(row_bytes));
      ReadRow(bytes, bitmap.Row(from_top_ ? row : height_ - 1 - row));
    }
    return bitmap;
  }

 private:
  void ReadHeader() {
    header_size_ = Bytes(input_, 4).U32(0);
    if (std::ranges::find(kHeaders, header_size_) == std::end(kHeaders))
      Fail(input_, "damaged BMP: found a header of " + std::to_string(header_size_) +
                       " bytes, expected 12, 40, 52, 56, 64, 108 or 124");
    const Bytes header(input_, header_size_ - 4);
    if (header_size_ == kCoreHeader) {
      width_ = header.U16(0);
      height_ = header.U16(2);
      depth_ = header.U16(6);
      return;
    }
    const auto height = static_cast<std::int32_t>(header.U32(4));
    width_ = header.U32(0);
    from_top_ = height < 0;
    height_ = from_top_ ? 0 - header.U32(4) : header.U32(4);
    depth_ = header.U16(10);
    compression_ = header.U32(12);
    colors_ = header.U32(28);
    if (header_size_ == kOs2Header) return;  // it has no masks: its compression 3 is Huffman's
    if (compression_ != kMasks && compression_ != kMasksWithAlpha) return;
    // Later headers contain the masks; after the one of Windows 3 they follow.
    red_mask_ = header_size_ > kInfoHeader ? header.U32(36) : Bytes(input_, 12).U32(0);
  }

  void CheckHeader() {
    if (compression_ != kNoCompression && red_mask_ == 0)
      Fail(input_, "this is a compressed BMP picture; save it uncompressed, or as PNG");
    constexpr std::uint32_t kDepths[] = {1, 4, 8, 16, 24, 32};
    if (std::ranges::find(kDepths, depth_) == std::end(kDepths))
      Fail(input_, "damaged BMP: found " + std::to_string(depth_) +
                       " bits per pixel, expected 1, 4, 8, 16, 24 or 32");
    if (red_mask_ == 0) red_mask_ = depth_ == 16 ? 0x7c00 : 0xff0000;
  }

  // Entries are blue, green, red and, in later files, a padding byte.
  void ReadPalette() {
    const std::size_t entry = header_size_ == kCoreHeader ? 3 : 4,
                      max_colors = std::size_t{1} << depth_;
    const std::size_t count =
        colors_ == 0 ? max_colors : std::min<std::size_t>(colors_, max_colors);
    if (std::fseek(input_.file, static_cast<long>(kFileHeader + header_size_), SEEK_SET) != 0)
      Fail(input_, "the file is cut short");
    const Bytes bytes(input_, entry * count);
    is_solid_.resize(max_colors);
    for (std::size_t i = 0; i < count; ++i) is_solid_[i] = bytes[entry * i + 2] <= input_.threshold;
  }

  void ReadRow(const Bytes& bytes, std::uint64_t* words) const {
    for (std::uint32_t x = 0; x < width_; ++x)
      words[x / 64] |= std::uint64_t{IsSolid(bytes, x)} << (x % 64);
  }

  bool IsSolid(const Bytes& bytes, std::size_t x) const {
    switch (depth_) {
      case 1:
        return is_solid_[bytes[x / 8] >> (7 - x % 8) & 1];
      case 4:
        return is_solid_[bytes[x / 2] >> (x % 2 == 0 ? 4 : 0) & 15];
      case 8:
        return is_solid_[bytes[x]];
      case 16:
        return RedOf(bytes.U16(2 * x)) <= input_.threshold;
      case 24:
        return bytes[3 * x + 2] <= input_.threshold;
      default:
        return RedOf(bytes.U32(4 * x)) <= input_.threshold;
    }
  }

  // Red component, scaled to 0..255.
  std::uint32_t RedOf(std::uint32_t pixel) const {
    const std::uint64_t max_value = red_mask_ >> std::countr_zero(red_mask_);
    return static_cast<std::uint32_t>(
        (std::uint64_t{pixel & red_mask_} >> std::countr_zero(red_mask_)) * 255 / max_value);
  }

  const Input& input_;
  std::uint32_t header_size_ = 0, width_ = 0, height_ = 0, depth_ = 0;
  std::uint32_t compression_ = kNoCompression, colors_ = 0, red_mask_ = 0;
  bool from_top_ = false;
  std::vector<bool> is_solid_;  // by palette index
};

}  // namespace

Bitmap ReadBmp(const Input& input) { return BmpReader(input).Read(); }

}  // namespace picture
}  // namespace Stg
