// SPDX-License-Identifier: GPL-2.0-or-later
// Tracing bitmaps into polygons.
#include "pictures/trace.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "pictures/picture.hh"

namespace {

using Stg::point_t;
using Stg::picture::Bitmap;
using Stg::picture::Load;
using Stg::picture::LoadFromMemory;
using Stg::picture::Trace;
using Polygons = std::vector<std::vector<point_t>>;

// Makes a bitmap from rows in which # is solid.
Bitmap Drawing(const std::vector<std::string>& rows) {
  Bitmap bitmap(rows.empty() ? 0 : int(rows[0].size()), int(rows.size()));
  for (std::size_t y = 0; y < rows.size(); ++y) {
    for (std::size_t x = 0; x < rows[y].size(); ++x) {
      if (rows[y][x] == '#') bitmap.MakeSolid(x, y);
    }
  }
  return bitmap;
}

TEST(Outlines, ThresholdIs127) {
  const std::string picture = "P5 7 1 255 " + std::string("\x7e\xff\x7f\xff\x80\xff\x81");
  const auto trace = [&picture](auto... threshold) {
    return Trace(LoadFromMemory(picture.data(), picture.size(), "test", threshold...));
  };
  const Polygons polygons = trace();
  ASSERT_EQ(polygons.size(), 2U);
  EXPECT_EQ(polygons[0][0], point_t(0, 0));
  EXPECT_EQ(polygons[1][0], point_t(2, 0));
  EXPECT_EQ(trace(std::uint8_t{128}).size(), 3U);
  EXPECT_EQ(trace(std::uint8_t{0}).size(), 0U);
  EXPECT_EQ(trace(std::uint8_t{255}).size(), 1U);
}

TEST(Outlines, ATracerForgetsThePictureBefore) {
  Stg::picture::Tracer tracer;
  std::mt19937 random(1);
  for (int round = 0; round < 100; ++round) {
    Bitmap bitmap(1 + int(random() % 90), 1 + int(random() % 20));
    for (int i = int(random() % 200); i > 0; --i)
      bitmap.MakeSolid(random() % unsigned(bitmap.width()), random() % unsigned(bitmap.height()));
    tracer.Trace(bitmap);
    const Polygons expected = Trace(bitmap);
    ASSERT_EQ(tracer.ends().size(), expected.size());
    std::size_t corner = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      for (const point_t& point : expected[i]) {
        const Stg::picture::Tracer::Corner at = tracer.corners()[corner++];
        ASSERT_EQ(point, point_t(at.x, -at.row)) << round;
      }
      ASSERT_EQ(corner, tracer.ends()[i]);
    }
  }
}

TEST(Outlines, NothingSolid) {
  EXPECT_TRUE(Trace(Drawing({"....", "...."})).empty());
  EXPECT_TRUE(Trace(Bitmap()).empty());
}

TEST(Outlines, FirstAndLastStepsStayUnjoined) {
  EXPECT_EQ(Trace(Drawing({"###", "###"})),
            (Polygons{{{0, 0}, {1, 0}, {3, 0}, {3, -2}, {0, -2}, {0, -1}}}));
}

TEST(Outlines, TopRowIsAtPlainZero) {
  EXPECT_FALSE(std::signbit(Trace(Drawing({"#"})).at(0).at(0).y));
}

TEST(Outlines, RingWithIsland) {
  const Polygons polygons = Trace(Drawing({"#####", "#...#", "#.#.#", "#...#", "#####"}));
  ASSERT_EQ(polygons.size(), 3U);
  EXPECT_EQ(polygons[0][0], point_t(0, 0));
  EXPECT_EQ(polygons[1][0], point_t(1, -1));
  EXPECT_EQ(polygons[2][0], point_t(2, -2));
}

TEST(Outlines, PixelsTouchingAtACorner) {
  EXPECT_EQ(Trace(Drawing({"#.", ".#"})),
            (Polygons{{{0, 0}, {1, 0}, {1, -1}, {0, -1}}, {{1, -1}, {2, -1}, {2, -2}, {1, -2}}}));
}

// Pixels on the other diagonal give one outline: its path to the smaller corner enters the other.
TEST(Outlines, PixelsTouchingAtTheOtherCorner) {
  EXPECT_EQ(Trace(Drawing({".#", "#."})),
            (Polygons{{{0, -1}, {1, -1}, {1, 0}, {2, 0}, {2, -1}, {1, -1}, {1, -2}, {0, -2}}}));
}

// Rows of n separate pixels, four corners each.
Bitmap Dots(std::size_t columns, std::size_t rows) {
  Bitmap bitmap(int(2 * columns), int(2 * rows));
  for (std::size_t i = 0; i < columns * rows; ++i) {
    bitmap.MakeSolid(2 * (i % columns), 2 * (i / columns));
  }
  return bitmap;
}

TEST(Outlines, SpeckleIsRefused) {
  static_assert(Stg::picture::kMaxCorners == 500000);
  EXPECT_EQ(Trace(Dots(250, 500)).size(), 125000U);
  try {
    Trace(Dots(251, 499));
    FAIL() << "125249 dots have 500996 corners";
  } catch (const Stg::LoadError& error) {
    EXPECT_STREQ(error.what(),
                 "found outlines with more than 500000 corners, expected a floor plan; remove its "
                 "speckle or scale it down");
    EXPECT_EQ(error.exit_status(), 255);
  }
}

// Pixels that touch at corners: each corner belongs to two outlines.
TEST(Outlines, CheckerboardsAreCountedTwice) {
  Bitmap board(600, 600);
  for (std::size_t i = 0; i < 360000; ++i) {
    if ((i % 600 + i / 600) % 2 == 0) board.MakeSolid(i % 600, i / 600);
  }
  EXPECT_THROW(Trace(board), Stg::LoadError);
}

// Outlines skip whole words of pixels, and stop at the picture's edge.
TEST(Outlines, RectanglesAtTheEndsOfWords) {
  for (const std::size_t width : {63U, 64U, 65U, 127U, 128U, 129U}) {
    Bitmap full(int(width), 3);
    for (std::size_t i = 0; i < 3 * width; ++i) full.MakeSolid(i % width, i / width);
    const double right = static_cast<double>(width);
    EXPECT_EQ(Trace(full), (Polygons{{{0, 0}, {1, 0}, {right, 0}, {right, -3}, {0, -3}, {0, -1}}}))
        << width;
  }
}

// Slow reference implementation of the definition: a sorted set of directed unit edges.
Polygons SlowTrace(const Bitmap& bitmap) {
  using Corner = std::pair<int, int>;
  std::set<std::pair<Corner, Corner>> edges;
  const auto add = [&edges](Corner from, Corner to) {
    if (edges.erase({to, from}) == 0) edges.insert({from, to});
  };
  for (int y = 0; y < bitmap.height(); ++y) {
    for (int x = 0; x < bitmap.width(); ++x) {
      if (!bitmap.IsSolid(std::size_t(x), std::size_t(y))) continue;
      add({x, y}, {x + 1, y});
      add({x + 1, y}, {x + 1, y + 1});
      add({x + 1, y + 1}, {x, y + 1});
      add({x, y + 1}, {x, y});
    }
  }
  const auto direction = [](Corner from, Corner to) {
    const auto sign = [](int v) { return (v > 0) - (v < 0); };
    return Corner(sign(to.first - from.first), sign(to.second - from.second));
  };
  Polygons polygons;
  while (!edges.empty()) {
    std::vector<Corner> polygon;
    for (auto edge = edges.begin(); edge != edges.end();) {
      const auto [start, end] = *edge;
      const std::size_t n = polygon.size();
      if (n > 2 && direction(polygon[n - 1], start) == direction(polygon[n - 2], polygon[n - 1])) {
        polygon.back() = start;
      } else {
        polygon.push_back(start);
      }
      edges.erase(edge);
      edge = edges.lower_bound({end, Corner(-1, -1)});
      if (edge != edges.end() && edge->first != end) edge = edges.end();
    }
    polygons.emplace_back();
    for (const auto& [x, y] : polygon) polygons.back().emplace_back(x, -y);
  }
  return polygons;
}

TEST(Outlines, SameAsTheDefinition) {
  std::mt19937 random(20240229);
  for (int round = 0; round < 400; ++round) {
    const std::size_t width = 1 + random() % (round % 8 == 0 ? 140 : 14);
    const std::size_t height = 1 + random() % 14;
    Bitmap bitmap{int(width), int(height)};
    const std::size_t threshold = 25 + random() % 206;
    for (std::size_t i = 0; i < width * height; ++i) {
      if (random() % 256 <= threshold) bitmap.MakeSolid(i % width, i / width);
    }
    ASSERT_EQ(Trace(bitmap), SlowTrace(bitmap)) << round;
  }
}

// ---- reference data: the bundled bitmaps of Stage 4.3, if they are at hand

struct Reference {
  const char* file;
  int width, height, solid, left, top, right, bottom;
  std::size_t polygons, vertices;
};

class ReferencePictures : public testing::TestWithParam<Reference> {};

TEST_P(ReferencePictures, SolidPixelsAndOutlines) {
  const char* const shared = std::getenv("STAGE_SHARED_DIR");
  if (shared == nullptr) GTEST_SKIP() << "STAGE_SHARED_DIR is not set";
  const Reference& expected = GetParam();
  const auto path = std::filesystem::path(shared) / "stage-worlds" / "bitmaps" / expected.file;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " does not exist";

  const Bitmap bitmap = Load(path);
  ASSERT_EQ(bitmap.width(), expected.width);
  ASSERT_EQ(bitmap.height(), expected.height);
  int solid = 0, left = bitmap.width(), top = bitmap.height(), right = -1, bottom = -1;
  for (int y = 0; y < bitmap.height(); ++y) {
    for (int x = 0; x < bitmap.width(); ++x) {
      if (!bitmap.IsSolid(std::size_t(x), std::size_t(y))) continue;
      ++solid;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
  }
  EXPECT_EQ(solid, expected.solid);
  EXPECT_EQ((std::array{left, top, right, bottom}),
            (std::array{expected.left, expected.top, expected.right, expected.bottom}));
  const Polygons polygons = Trace(bitmap);
  std::size_t vertices = 0;
  for (const auto& polygon : polygons) vertices += polygon.size();
  EXPECT_EQ(polygons.size(), expected.polygons);
  EXPECT_EQ(vertices, expected.vertices);
}

INSTANTIATE_TEST_SUITE_P(
    Stage43, ReferencePictures,
    testing::Values(Reference{"cave.png", 500, 500, 5270, 0, 0, 499, 499, 15, 1462},
                    Reference{"cave_filled.png", 500, 500, 59067, 0, 0, 499, 499, 8, 729},
                    Reference{"ghost.png", 23, 20, 134, 4, 3, 17, 16, 3, 70},
                    Reference{"hospital.png", 3117, 1189, 95287, 1, 1, 3116, 1188, 979, 17357},
                    Reference{"hospital_section.png", 1086, 443, 17158, 4, 0, 1085, 442, 66, 1805},
                    Reference{"simple_rooms.png", 400, 300, 36816, 0, 0, 399, 299, 2, 60},
                    Reference{"space_invader.png", 122, 101, 3486, 13, 13, 108, 82, 5, 66}),
    [](const auto& param_info) {
      const std::string file = param_info.param.file;
      return file.substr(0, file.find('.'));
    });

}  // namespace
