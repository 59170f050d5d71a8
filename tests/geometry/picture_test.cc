// SPDX-License-Identifier: GPL-2.0-or-later
// Reading picture files into rasters.
#include "pictures/picture.hh"

#include <gtest/gtest.h>
#include <png.h>
#include <stdlib.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "pictures/image_polygons.hh"
#include "pictures/trace.hh"

namespace {

using Stg::point_t;
using Stg::picture::Bitmap;
using Stg::picture::Load;
using Stg::picture::LoadFromMemory;
using Stg::picture::Trace;
using Polygons = std::vector<std::vector<point_t>>;

// ---- making pictures

// The sample of pixel (x, y) in a channel; for palettes, the index.
using SampleOf = std::function<unsigned(int x, int y, int channel)>;

struct PngKind {
  int width = 0, height = 0, depth = 8, colour_type = PNG_COLOR_TYPE_GRAY;
  bool interlaced = false;
  std::vector<png_color> palette = {};
};

int ChannelsOf(int colour_type) {
  switch (colour_type) {
    case PNG_COLOR_TYPE_GRAY_ALPHA:
      return 2;
    case PNG_COLOR_TYPE_RGB:
      return 3;
    case PNG_COLOR_TYPE_RGBA:
      return 4;
    default:
      return 1;
  }
}

// A row of samples as PNG packs them: most significant bits first.
std::vector<png_byte> PackRow(const PngKind& kind, int y, const SampleOf& sample_of) {
  const int channels = ChannelsOf(kind.colour_type);
  const int bits = kind.width * channels * kind.depth;
  std::vector<png_byte> row(static_cast<std::size_t>((bits + 7) / 8));
  int at = 0;
  for (int x = 0; x < kind.width; ++x) {
    for (int channel = 0; channel < channels; ++channel) {
      const unsigned sample = sample_of(x, y, channel);
      for (int bit = kind.depth - 1; bit >= 0; --bit, ++at) {
        if (sample >> bit & 1U) row[static_cast<std::size_t>(at / 8)] |= png_byte(128 >> at % 8);
      }
    }
  }
  return row;
}

std::string MakePng(const PngKind& kind, const SampleOf& sample_of) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, std::size_t size) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<char*>(data), size);
      },
      nullptr);
  png_set_IHDR(png, info, png_uint_32(kind.width), png_uint_32(kind.height), kind.depth,
               kind.colour_type, kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!kind.palette.empty()) {
    png_set_PLTE(png, info, kind.palette.data(), int(kind.palette.size()));
  }
  png_write_info(png, info);
  std::vector<std::vector<png_byte>> rows;
  std::vector<png_bytep> pointers;
  for (int y = 0; y < kind.height; ++y) rows.push_back(PackRow(kind, y, sample_of));
  for (auto& row : rows) pointers.push_back(row.data());
  png_write_image(png, pointers.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

Bitmap LoadBytes(const std::string& bytes, std::uint8_t threshold = 127) {
  return LoadFromMemory(bytes.data(), bytes.size(), "test", threshold);
}

using Samples = std::vector<std::uint8_t>;

// Each pixel's sample, as the number of thresholds at which the pixel is free.
template <typename LoadAt>
Samples SamplesOf(const LoadAt& load) {
  Samples samples;
  for (unsigned threshold = 0; threshold < 256; ++threshold) {
    const Bitmap bitmap = load(static_cast<std::uint8_t>(threshold));
    const std::size_t width = std::size_t(bitmap.width());
    samples.resize(width * std::size_t(bitmap.height()));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!bitmap.IsSolid(i % width, i / width)) ++samples[i];
    }
  }
  return samples;
}

Samples SamplesOfBytes(const std::string& bytes) {
  return SamplesOf([&bytes](std::uint8_t threshold) { return LoadBytes(bytes, threshold); });
}

Samples SamplesOfFile(const std::string& path) {
  return SamplesOf([&path](std::uint8_t threshold) { return Load(path, threshold); });
}

// Message of the LoadError that `action` throws; empty if none.
std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Stg::LoadError& error) {
    EXPECT_EQ(error.exit_status(), 255);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

std::string ErrorOfBytes(const std::string& bytes) {
  return ErrorOf([&bytes] { LoadBytes(bytes); });
}

void ExpectContains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "\"" << text << "\" lacks \"" << part << "\"";
}

// ---- PNG

struct DepthCase {
  int colour_type, depth;
};

class PngKinds : public testing::TestWithParam<std::tuple<DepthCase, bool>> {};

// Each kind in several sizes. Below 8 pixels, some passes of interlaced pictures are empty.
TEST_P(PngKinds, FirstSampleOfEachPixel) {
  const auto [depth_case, interlaced] = GetParam();
  const auto [colour_type, depth] = depth_case;
  const unsigned top = (1U << depth) - 1;
  const auto sample_of = [top](int x, int y, int channel) {
    return unsigned(x * 7919 + y * 104729 + channel * 31337) * 2654435761U >> 8 & top;
  };
  const std::array<std::pair<int, int>, 7> sizes{
      {{1, 1}, {2, 1}, {1, 5}, {4, 4}, {5, 3}, {9, 8}, {37, 23}}};
  for (const auto& [width, height] : sizes) {
    SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height));
    const std::string bytes = MakePng({width, height, depth, colour_type, interlaced}, sample_of);
    ASSERT_EQ(LoadBytes(bytes).width(), width);
    ASSERT_EQ(LoadBytes(bytes).height(), height);
    const Samples samples = SamplesOfBytes(bytes);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const unsigned sample = sample_of(x, y, 0);
        const unsigned expected = depth == 16 ? sample >> 8 : sample * 255 / top;
        ASSERT_EQ(samples[std::size_t(y * width + x)], expected) << x << "," << y;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, PngKinds,
    testing::Combine(
        testing::Values(DepthCase{PNG_COLOR_TYPE_GRAY, 1}, DepthCase{PNG_COLOR_TYPE_GRAY, 2},
                        DepthCase{PNG_COLOR_TYPE_GRAY, 4}, DepthCase{PNG_COLOR_TYPE_GRAY, 8},
                        DepthCase{PNG_COLOR_TYPE_GRAY, 16}, DepthCase{PNG_COLOR_TYPE_GRAY_ALPHA, 8},
                        DepthCase{PNG_COLOR_TYPE_GRAY_ALPHA, 16}, DepthCase{PNG_COLOR_TYPE_RGB, 8},
                        DepthCase{PNG_COLOR_TYPE_RGB, 16}, DepthCase{PNG_COLOR_TYPE_RGBA, 8},
                        DepthCase{PNG_COLOR_TYPE_RGBA, 16}),
        testing::Bool()));

TEST(Png, PalettesAreLookedUp) {
  const std::vector<png_color> palette{{200, 0, 0}, {0, 255, 255}};
  for (const int depth : {1, 2, 4, 8}) {
    for (const bool interlaced : {false, true}) {
      const Samples samples =
          SamplesOfBytes(MakePng({5, 4, depth, PNG_COLOR_TYPE_PALETTE, interlaced, palette},
                                 [](int x, int y, int) { return unsigned(x + y) % 2; }));
      for (std::size_t i = 0; i < 20; ++i) {
        ASSERT_EQ(samples[i], (i % 5 + i / 5) % 2 == 0 ? 200 : 0) << depth << " " << i;
      }
    }
  }
}

TEST(Png, RedDecides) {
  // red, green, blue, yellow, cyan, white, transparent black, transparent white
  const unsigned pixels[8][4] = {{255, 0, 0, 255},   {0, 255, 0, 255},   {0, 0, 255, 255},
                                 {255, 255, 0, 255}, {0, 255, 255, 255}, {255, 255, 255, 255},
                                 {0, 0, 0, 0},       {255, 255, 255, 0}};
  EXPECT_EQ(SamplesOfBytes(MakePng({8, 1, 8, PNG_COLOR_TYPE_RGBA},
                                   [&](int x, int, int c) { return pixels[x][c]; })),
            (Samples{255, 0, 0, 255, 0, 255, 0, 255}));
}

TEST(Png, SixteenBitsAreCutNotRounded) {
  const unsigned samples[3] = {0x7fff, 0x8000, 0x00ff};
  EXPECT_EQ(SamplesOfBytes(MakePng({3, 1, 16}, [&](int x, int, int) { return samples[x]; })),
            (Samples{0x7f, 0x80, 0}));
}

TEST(Png, CutShortAnywhereIsAnError) {
  for (const bool interlaced : {false, true}) {
    const std::string bytes = MakePng({40, 30, 8, PNG_COLOR_TYPE_GRAY, interlaced},
                                      [](int x, int y, int) { return unsigned(x * y) & 255; });
    EXPECT_EQ(ErrorOfBytes(bytes), "");
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      ASSERT_NE(ErrorOfBytes(bytes.substr(0, size)), "") << size;
    }
    ExpectContains(ErrorOfBytes(bytes.substr(0, bytes.size() / 2)), "cut short");
  }
}

// ---- damaged checksums are repaired, so that mutations reach the code behind them

std::uint32_t ChecksumOf(const std::string& bytes, std::size_t from, std::size_t size) {
  std::uint32_t sum = 0xffffffff;
  for (std::size_t i = from; i < from + size; ++i) {
    sum ^= static_cast<unsigned char>(bytes[i]);
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1) ^ ((sum & 1) != 0 ? 0xedb88320U : 0);
  }
  return ~sum;
}

std::uint32_t ReadBigEndian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | std::uint8_t(bytes[i]);
  return value;
}

void WriteBigEndian(std::string& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = char(value >> (24 - 8 * i) & 255);
}

void RepairChecksums(std::string& bytes) {
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const std::size_t length = ReadBigEndian(bytes, at);
    if (length > bytes.size() - at - 12) return;
    WriteBigEndian(bytes, at + 8 + length, ChecksumOf(bytes, at + 4, length + 4));
    at += 12 + length;
  }
}

TEST(Png, DeclaredSizeAllocatesNoMemory) {
  const std::string bytes = MakePng({8, 8}, [](int, int, int) { return 0U; });
  const auto declare = [&bytes](std::uint32_t width, std::uint32_t height) {
    std::string changed = bytes;
    WriteBigEndian(changed, 16, width);
    WriteBigEndian(changed, 20, height);
    RepairChecksums(changed);
    return ErrorOfBytes(changed);
  };
  EXPECT_EQ(declare(8, 8), "");
  EXPECT_EQ(declare(32769, 8),
            "test: a picture of 32769 x 8 pixels is too large; at most 32768 pixels a side are "
            "accepted");
  ExpectContains(declare(8, 0x7fffffff), "too large");
  EXPECT_EQ(declare(32768, 3052),
            "test: a picture of 32768 x 3052 pixels is too large; at most 100000000 pixels are "
            "accepted");
  ExpectContains(declare(10000, 10000), "cut short");
  EXPECT_NE(declare(0, 8), "");
  EXPECT_NE(declare(8, 9), "");
  EXPECT_NE(declare(0xffffffff, 0xffffffff), "");
}

TEST(Png, LargeTextIsSkipped) {
  std::string bytes = MakePng({2, 1}, [](int x, int, int) { return unsigned(x); });
  std::string text = std::string("\0\0\0\0tEXtComment\0", 16) + std::string(5000000, 'x') + "CRC!";
  WriteBigEndian(text, 0, std::uint32_t(text.size() - 12));
  bytes.insert(33, text);  // after the header
  RepairChecksums(bytes);
  EXPECT_EQ(SamplesOfBytes(bytes), (Samples{0, 1}));
}

// ---- PBM, PGM, PPM

TEST(Pnm, AllKinds) {
  EXPECT_EQ(SamplesOfBytes("P1\n# walls\n3 2\n101\n0 1 0\n"), (Samples{0, 255, 0, 255, 0, 255}));
  EXPECT_EQ(SamplesOfBytes("P2 2 1 255 7 # seven\n 200"), (Samples{7, 200}));
  EXPECT_EQ(SamplesOfBytes("P3 2 1 255 1 2 3 4 5 6\n"), (Samples{1, 4}));
  EXPECT_EQ(
      SamplesOfBytes("P4\n10 2\n\xff\x80\x01\x40"),
      (Samples{0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 0, 255, 0}));
  EXPECT_EQ(SamplesOfBytes("P5\n# CREATOR: map_saver\n2 2\n255\n\nab\xfe"),
            (Samples{10, 'a', 'b', 254}));
  EXPECT_EQ(SamplesOfBytes("P6 2 1 255 abcdef"), (Samples{'a', 'd'}));
}

TEST(Pnm, LargestSample) {
  EXPECT_EQ(SamplesOfBytes("P2 4 1 3 0 1 2 3"), (Samples{0, 85, 170, 255}));
  EXPECT_EQ(SamplesOfBytes("P5 2 1 1\n" + std::string("\0\1", 2)), (Samples{0, 255}));
  EXPECT_EQ(SamplesOfBytes("P5 2 1 65535\n\x7f\xff\x80" + std::string(1, '\0')),
            (Samples{127, 128}));
  EXPECT_EQ(SamplesOfBytes("P6 1 1 65535\n\x12\x34zzzz"), (Samples{0x12}));
  EXPECT_EQ(SamplesOfBytes("P2 2 1 1000 500 1000"), (Samples{127, 255}));
}

TEST(Pnm, Errors) {
  ExpectContains(ErrorOfBytes("P5 2 2 255\nabc"), "cut short");
  ExpectContains(ErrorOfBytes("P2 2 2 255 1 2 3"), "cut short");
  ExpectContains(ErrorOfBytes("P5 2"), "cut short");
  ExpectContains(ErrorOfBytes("P2 1 1 9 10"), "above the largest");
  ExpectContains(ErrorOfBytes("P5 0 1 255\n"), "empty");
  ExpectContains(ErrorOfBytes("P5 1 1 0\na"), "1 to 65535");
  ExpectContains(ErrorOfBytes("P5 1 1 65536\naa"), "1 to 65535");
  ExpectContains(ErrorOfBytes("P5 99999999999999999999 1 255\n"), "too large a number");
  ExpectContains(ErrorOfBytes("P5 100000 1 255\n"), "too large");
  ExpectContains(ErrorOfBytes("P5 10000 10000 255\n"), "cut short");
  ExpectContains(ErrorOfBytes("P5 10001 10000 255\n"), "at most 100000000 pixels");
  ExpectContains(ErrorOfBytes("P6 10000 10000 65535\n"), "48 bits each is too large");
  ExpectContains(ErrorOfBytes("P1 2 1 1 2"), "found '2', expected 0 or 1");
  ExpectContains(ErrorOfBytes("P2 x 1"), "found 'x', expected the width");
  ExpectContains(ErrorOfBytes("P5 1 -1 255\na"), "expected the height");
}

// ---- files

class PictureFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "picture_test_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& bytes) {
    std::string path = folder_ / name;
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }

  std::filesystem::path folder_;
};

TEST_F(PictureFiles, Load) {
  const SampleOf sample_of = [](int x, int y, int) { return unsigned(10 * x + y); };
  EXPECT_EQ(SamplesOfFile(Write("a.png", MakePng({3, 2}, sample_of))),
            (Samples{0, 10, 20, 1, 11, 21}));
  // The format is recognized by content, not by name.
  EXPECT_EQ(SamplesOfFile(Write("b.png", "P5 1 1 255 x")), (Samples{'x'}));
}

TEST_F(PictureFiles, Errors) {
  const auto error_of = [](const std::string& path) {
    std::string message = ErrorOf([&path] { Load(path); });
    EXPECT_EQ(message.rfind(path + ": ", 0), 0U) << message;
    return message;
  };
  ExpectContains(error_of(folder_ / "missing.png"), "No such file");
  ExpectContains(error_of(folder_), "directory");
  ExpectContains(error_of("/dev/null"), "not a regular file");
  ExpectContains(error_of(Write("empty.png", "")), "empty");
  ExpectContains(error_of(Write("text.png", "hello")), "accepted are PNG, JPEG, GIF, BMP, PBM");
  ExpectContains(error_of(Write("a.jpg", "\xff\xd8\xff\xe0 JFIF")), "unreadable JPEG");
  ExpectContains(error_of(Write("a.gif", "GIF89a")), "unreadable GIF");
  ExpectContains(error_of(Write("a.bmp", "BM______")), "cut short");
  ExpectContains(error_of(Write("a.xpm", "/* XPM */")), "XPM");
  ExpectContains(error_of(Write("a.webp", "RIFF1234WEBPVP8")), "WebP");
}

TEST_F(PictureFiles, PolysFromImageFile) {
  Polygons polygons{{point_t(1, 2)}};
  testing::internal::CaptureStderr();
  EXPECT_NE(Stg::polys_from_image_file(folder_ / "missing.png", polygons), 0);
  ExpectContains(testing::internal::GetCapturedStderr(), "missing.png: ");
  EXPECT_EQ(polygons, (Polygons{{point_t(1, 2)}}));
  EXPECT_EQ(Stg::polys_from_image_file(Write("a.pbm", "P1 1 1 1"), polygons), 0);
  EXPECT_EQ(polygons, (Polygons{{{0, 0}, {1, 0}, {1, -1}, {0, -1}}}));
}

// ---- mutated files

std::string Mutated(const std::string& bytes, std::mt19937& random) {
  std::string changed = bytes;
  for (unsigned count = 1 + random() % 4; count > 0 && !changed.empty(); --count) {
    const std::size_t at = random() % changed.size();
    switch (random() % 6) {
      case 0:
        changed[at] = char(changed[at] ^ 1 << random() % 8);
        break;
      case 1:
        changed[at] = char(random() % 256);
        break;
      case 2:
        changed.insert(at, 1 + random() % 8, char(random() % 256));
        break;
      case 3:
        changed.erase(at, 1 + random() % 8);
        break;
      case 4:
        changed.insert(at, changed.substr(random() % changed.size(), 16));
        break;
      default:
        changed.resize(at);
        break;
    }
  }
  return changed;
}

TEST(MutatedPictures, LoadOrLoadError) {
  const SampleOf sample_of = [](int x, int y, int) { return unsigned(x * 3 + y) % 4; };
  const std::vector<std::string> originals{
      MakePng({19, 13, 8}, sample_of),
      MakePng({19, 13, 2, PNG_COLOR_TYPE_PALETTE, true, {{0, 0, 0}, {255, 0, 0}, {9, 9, 9}}},
              [](int x, int y, int) { return unsigned(x + y) % 3; }),
      MakePng({9, 7, 16, PNG_COLOR_TYPE_RGBA, true}, sample_of),
      "P5\n# a map\n8 4\n255\n01234567abcdefgh01234567abcdefgh",
      "P2\n4 2\n15\n1 2 3 4\n5 6 7 15\n",
      "P4 9 3\n------"};
  std::mt19937 random(5);
  int loaded = 0, refused = 0;
  for (int round = 0; round < 5000; ++round) {
    std::string bytes = Mutated(originals[std::size_t(round) % originals.size()], random);
    if (random() % 4 != 0) RepairChecksums(bytes);
    try {
      Trace(LoadBytes(bytes));
      ++loaded;
    } catch (const Stg::LoadError&) {
      ++refused;
    }
  }
  EXPECT_GT(loaded, 100);  // otherwise the mutations would test little
  EXPECT_GT(refused, 100);
}

}  // namespace
