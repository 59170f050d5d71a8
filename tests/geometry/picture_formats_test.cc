// SPDX-License-Identifier: GPL-2.0-or-later
// Tests one map in all supported picture formats: tests/data/maps, written by Pillow.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "geometry/load_error.hh"
#include "pictures/picture.hh"

namespace {

using Stg::picture::Bitmap;
using Stg::picture::LoadFromMemory;

std::string BytesOf(const std::string& name) {
  const std::string path =
      std::string(std::getenv("STAGE_SOURCE_DIR")) + "/tests/data/maps/" + name;
  std::ifstream in(path, std::ios::binary);
  EXPECT_TRUE(in) << path;
  return {std::istreambuf_iterator<char>(in), {}};
}

Bitmap LoadBytes(const std::string& bytes) {
  return LoadFromMemory(bytes.data(), bytes.size(), "test");
}

/// One row of text for each row of pixels.
std::vector<std::string> Drawing(const Bitmap& bitmap) {
  std::vector<std::string> rows;
  for (int y = 0; y < bitmap.height(); ++y) {
    rows.emplace_back();
    for (int x = 0; x < bitmap.width(); ++x)
      rows.back() += bitmap.IsSolid(std::size_t(x), std::size_t(y)) ? '#' : '.';
  }
  return rows;
}

std::string ErrorOf(const std::string& bytes) {
  try {
    LoadBytes(bytes);
  } catch (const Stg::LoadError& error) {
    EXPECT_EQ(error.exit_status(), 255);
    return error.what();
  }
  return "";
}

class Formats : public testing::TestWithParam<const char*> {};

TEST_P(Formats, GiveTheBitmapThatThePgmGives) {
  const auto wanted = Drawing(LoadBytes(BytesOf("flat.pgm")));
  ASSERT_EQ(wanted.size(), 30U);
  EXPECT_EQ(wanted[4].substr(0, 10), "......####");
  EXPECT_EQ(Drawing(LoadBytes(BytesOf(GetParam()))), wanted);
}

/// Truncated files are rejected, unless only bytes after the pixels are missing.
TEST_P(Formats, RefuseFilesThatAreCutShort) {
  const std::string bytes = BytesOf(GetParam());
  const auto whole = Drawing(LoadBytes(bytes));
  std::size_t refused = 0;
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const std::string part = bytes.substr(0, length);
    const std::string error = ErrorOf(part);
    refused += !error.empty();
    if (error.empty()) {
      EXPECT_EQ(Drawing(LoadBytes(part)), whole) << length;
    }
  }
  EXPECT_GE(refused + 200, bytes.size());
}

TEST_P(Formats, SurviveAnyByteThatIsWrong) {
  const std::string bytes = BytesOf(GetParam());
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const int change : {1, 0x80, 0xff}) {
      std::string wrong = bytes;
      wrong[at] = static_cast<char>(wrong[at] ^ change);
      ErrorOf(wrong);  // may be valid; must not trip sanitizers
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Maps, Formats,
                         testing::Values("grey.jpg", "colour.jpg", "progressive.jpg", "plain.gif",
                                         "interlaced.gif", "animated.gif", "one_bit.bmp",
                                         "grey.bmp", "colour.bmp", "alpha.bmp"),
                         [](const auto& of) {
                           std::string name = of.param;
                           name[name.find('.')] = '_';
                           return name;
                         });

TEST(Jpeg, RefusesCmyk) { EXPECT_NE(ErrorOf(BytesOf("cmyk.jpg")).find("CMYK"), std::string::npos); }

// ---- BMP, which this project reads by itself: all depths and headers
// ------------------------------

struct BmpKind {
  unsigned header, depth;  // bytes of the header, bits of a pixel
  bool from_top = false;
  unsigned red_mask = 0;  // 0: the usual place of red
};

void Append(std::string* bytes, std::uint32_t value, int count) {
  for (int i = 0; i < count; ++i) *bytes += static_cast<char>(value >> 8 * i & 0xff);
}

unsigned RedMask(const BmpKind& kind) {
  if (kind.red_mask != 0) return kind.red_mask;
  return kind.depth == 16 ? 0x7c00 : 0xff0000;
}

/// A BMP file of 11 x 3 pixels; those with x + y divisible by 3 are dark.
std::string MakeBmp(const BmpKind& kind) {
  constexpr unsigned kWidth = 11, kHeight = 3;
  std::string head, rows;
  Append(&head, kind.header, 4);
  if (kind.header == 12) {
    Append(&head, kWidth | kHeight << 16, 4);
    Append(&head, 1 | kind.depth << 16, 4);
  } else {
    Append(&head, kWidth, 4);
    Append(&head, kind.from_top ? 0 - kHeight : kHeight, 4);
    Append(&head, 1 | kind.depth << 16, 4);
    Append(&head, kind.red_mask != 0 ? 3 : 0, 4);
    for (int i = 0; i < 5; ++i) Append(&head, 0, 4);
    if (kind.red_mask != 0)
      Append(&head, kind.red_mask, 4), Append(&head, 0, 4), Append(&head, 0, 4);
    while (head.size() < kind.header) head += '\0';
  }
  // All indices are dark except the last.
  const unsigned light = (1U << std::min(kind.depth, 8U)) - 1;
  for (unsigned i = 0; kind.depth <= 8 && i <= light; ++i) {
    const bool is_dark = i != light;
    head += {0, 0, static_cast<char>(is_dark ? 20 : 200)};
    if (kind.header > 12) head += '\0';
  }
  for (unsigned row = 0; row < kHeight; ++row) {
    const unsigned y = kind.from_top ? row : kHeight - 1 - row;
    std::string bits;
    for (unsigned x = 0; x < kWidth; ++x) {
      const bool dark = (x + y) % 3 == 0;
      const std::uint32_t pixel = kind.depth <= 8 ? (dark ? 0 : light) : dark ? 0 : RedMask(kind);
      if (kind.depth >= 8)
        for (unsigned i = 0; i < kind.depth / 8; ++i) bits += static_cast<char>(pixel >> 8 * i);
      else if (x * kind.depth % 8 == 0)
        bits += static_cast<char>(pixel << (8 - kind.depth));
      else
        bits.back() =
            static_cast<char>(bits.back() | pixel << (8 - kind.depth - x * kind.depth % 8));
    }
    bits.resize((bits.size() + 3) / 4 * 4);
    rows += bits;
  }
  std::string file = "BM";
  Append(&file, 0, 4), Append(&file, 0, 4);
  Append(&file, static_cast<std::uint32_t>(14 + head.size()), 4);
  return file + head + rows;
}

TEST(Bmp, AllDepthsAndHeadersGiveTheSameBitmap) {
  int kinds = 0;
  for (const unsigned header : {12, 40, 64, 108, 124}) {
    for (const unsigned depth : {1, 4, 8, 16, 24, 32}) {
      for (const bool from_top : {false, true}) {
        for (const unsigned mask : {0x0U, 0xf800U, 0xffU}) {
          const bool has_masks = depth == 16 || depth == 32;
          if (header == 12 && from_top) continue;
          if (mask != 0 && (header == 12 || header == 64)) continue;
          if (mask != 0 && !has_masks) continue;
          const auto drawing = Drawing(LoadBytes(MakeBmp({header, depth, from_top, mask})));
          const std::string what = std::to_string(header) + ' ' + std::to_string(depth) + ' ' +
                                   std::to_string(from_top) + ' ' + std::to_string(mask);
          ASSERT_EQ(drawing.size(), 3U) << what;
          EXPECT_EQ(drawing[0], "#..#..#..#.") << what;
          EXPECT_EQ(drawing[1], "..#..#..#..") << what;
          EXPECT_EQ(drawing[2], ".#..#..#..#") << what;
          ++kinds;
        }
      }
    }
  }
  EXPECT_GT(kinds, 50);
}

TEST(Bmp, RefusesWhatItCannotRead) {
  const auto changed = [](std::size_t at, int value) {
    std::string bytes = MakeBmp({40, 24});
    bytes[at] = static_cast<char>(value);
    return ErrorOf(bytes);
  };
  EXPECT_NE(changed(30, 1).find("compressed BMP"), std::string::npos);
  EXPECT_NE(changed(28, 23).find("23 bits per pixel, expected 1,"), std::string::npos);
  EXPECT_NE(changed(14, 39).find("a header of 39 bytes, expected 12, 40,"), std::string::npos);
  EXPECT_NE(changed(20, 100).find("too large"), std::string::npos);
  EXPECT_NE(changed(23, 1).find("cut short"), std::string::npos);
}

// Compression 3 means masks in a header of Windows, but Huffman's code in that of OS/2 2.x.
TEST(Bmp, RefusesHuffmanCodeOfOs2) {
  std::string bytes = MakeBmp({64, 24});
  bytes[30] = 3;
  EXPECT_NE(ErrorOf(bytes).find("compressed BMP"), std::string::npos);
  bytes[14 + 40] = '\x7f';  // the mask of red in other headers of this size
  EXPECT_NE(ErrorOf(bytes).find("compressed BMP"), std::string::npos);
}

}  // namespace
