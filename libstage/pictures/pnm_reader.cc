// SPDX-License-Identifier: GPL-2.0-or-later
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "pictures/picture_reader.hh"

namespace Stg {
namespace picture {
namespace {

class PnmReader {
 public:
  explicit PnmReader(const Input& input) : input_(input) {}

  Bitmap Read() {
    GetByte();  // the letter P
    const int kind = GetByte() - '0';
    plain_ = kind <= 3;
    bitmap_ = kind == 1 || kind == 4;
    channels_ = kind == 3 || kind == 6 ? 3 : 1;
    const unsigned width = ReadNumber("the width");
    const unsigned height = ReadNumber("the height");
    if (!bitmap_) largest_ = ReadNumber("the largest sample");
    if (largest_ == 0 || largest_ > 65535)
      Fail(input_,
           "found a largest sample of " + std::to_string(largest_) + ", expected 1 to 65535");
    if (!plain_) SkipSeparator();

    const std::uint64_t bits = bitmap_ ? 1 : channels_ * (largest_ > 255 ? 16 : 8);
    const bool in_rows = !plain_ && width <= kMaxSide;
    row_.resize(in_rows ? static_cast<std::size_t>((width * bits + 7) / 8) : 0);
    const std::uint64_t row_bytes = plain_ ? std::uint64_t{width} * channels_ : row_.size();
    Bitmap bitmap = MakeBitmap(input_, width, height, bits, row_bytes * height);
    if (input_.samples) *input_.samples = {bitmap.width(), bitmap.height(), 1, {}};
    for (unsigned y = 0; y < height; ++y) ReadRow(bitmap.Row(y), width);
    return bitmap;
  }

 private:
  void ReadRow(std::uint64_t* words, std::size_t width) {
    if (!plain_) ReadBytes(row_.data(), row_.size());
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint8_t sample = SampleOf(x);
      words[x / 64] |= std::uint64_t{sample <= input_.threshold} << (x % 64);
      if (input_.samples) input_.samples->values.push_back(sample);
    }
  }

  std::uint8_t SampleOf(std::size_t x) {
    if (!bitmap_) return To8Bits(plain_ ? ReadPlainPixel() : RawPixel(x));
    const bool black = plain_ ? ReadBit() : (row_[x / 8] >> (7 - x % 8) & 1) != 0;
    return black ? 0 : 255;
  }

  unsigned RawPixel(std::size_t x) const {
    if (largest_ <= 255) return row_[x * channels_];
    const std::size_t at = 2 * x * channels_;
    return unsigned{row_[at]} << 8 | row_[at + 1];
  }

  unsigned ReadPlainPixel() {
    const unsigned first = ReadNumber("a sample");
    for (unsigned others = 1; others < channels_; ++others) ReadNumber("a sample");
    return first;
  }

  // Plain bitmaps need no blanks between digits.
  bool ReadBit() {
    const int byte = SkipBlanks();
    if (byte != '0' && byte != '1') FailAt(byte, "0 or 1");
    return byte == '1';
  }

  std::uint8_t To8Bits(unsigned sample) const {
    if (sample > largest_) {
      Fail(input_, "sample " + std::to_string(sample) + " is above the largest one declared, " +
                       std::to_string(largest_));
    }
    // True 16-bit samples are truncated to their high byte, as in a PNG.
    return static_cast<std::uint8_t>(largest_ == 65535 ? sample >> 8 : sample * 255 / largest_);
  }

  // Skips white space and comments. Consumes and returns the byte after them.
  int SkipBlanks() {
    for (;;) {
      const int byte = GetByte();
      if (byte == '#') {
        SkipLine();
      } else if (!IsBlank(byte)) {
        return byte;
      }
    }
  }

  void SkipLine() {
    for (int byte = GetByte(); byte != '\n' && byte != EOF;) byte = GetByte();
  }

  // Skips the single blank, or the comment, that ends the header before raw samples.
  void SkipSeparator() {
    const int byte = GetByte();
    if (byte == '#') {
      SkipLine();
    } else if (!IsBlank(byte)) {
      FailAt(byte, "a space");
    }
  }

  unsigned ReadNumber(const char* what) {
    int byte = SkipBlanks();
    if (byte < '0' || byte > '9') FailAt(byte, what);
    unsigned value = 0;
    for (; byte >= '0' && byte <= '9'; byte = GetByte()) {
      if (value > 99999999) Fail(input_, std::string(what) + " is too large a number");
      value = value * 10 + static_cast<unsigned>(byte - '0');
    }
    if (byte != EOF) --at_;
    return value;
  }

  [[noreturn]] void FailAt(int byte, const std::string& expected) const {
    if (byte == EOF) Fail(input_, "the file is cut short");
    char found[16];
    std::snprintf(found, sizeof found, byte > ' ' && byte < 127 ? "'%c'" : "byte 0x%02x", byte);
    Fail(input_, std::string("found ") + found + ", expected " + expected);
  }

  int GetByte() { return at_ < end_ || Fill() ? buffer_[at_++] : EOF; }

  bool Fill() {
    at_ = 0;
    end_ = std::fread(buffer_.data(), 1, buffer_.size(), input_.file);
    return end_ > 0;
  }

  void ReadBytes(std::uint8_t* to, std::size_t count) {
    const std::size_t buffered = std::min(count, end_ - at_);
    std::copy_n(buffer_.data() + at_, buffered, to);
    at_ += buffered;
    if (std::fread(to + buffered, 1, count - buffered, input_.file) != count - buffered) {
      Fail(input_, "the file is cut short");
    }
  }

  static bool IsBlank(int byte) { return byte == ' ' || (byte >= '\t' && byte <= '\r'); }

  const Input& input_;
  bool plain_ = false;   // samples are decimal numbers
  bool bitmap_ = false;  // samples are bits; 1 is black
  unsigned channels_ = 1;
  unsigned largest_ = 1;
  std::vector<std::uint8_t> row_;
  std::array<std::uint8_t, 1 << 16> buffer_;
  std::size_t at_ = 0;   // read position in the buffer
  std::size_t end_ = 0;  // number of bytes in the buffer
};

}  // namespace

Bitmap ReadPnm(const Input& input) { return PnmReader(input).Read(); }

}  // namespace picture
}  // namespace Stg
