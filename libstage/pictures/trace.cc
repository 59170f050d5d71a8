// SPDX-License-Identifier: GPL-2.0-or-later
#include "pictures/trace.hh"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "pictures/image_polygons.hh"

namespace Stg {
namespace picture {
namespace {

// Directions of edges from a corner, sorted by the corner that they lead to (by x, then row).
enum Direction : unsigned { kLeft, kUp, kDown, kRight };

// 64 corners between two rows of pixels, one bit each.
struct CornerWords {
  std::array<std::uint64_t, 4> edges;  // by direction
  std::uint64_t turns;                 // outline changes its direction
  std::uint64_t crossings;             // two outlines, or two parts of one, touch
};

// Computes the corners from the four pixels around each. An edge separates a solid pixel, on its
// right, from a free one (rows count downwards).
CornerWords CornersAmong(std::uint64_t above_left, std::uint64_t above_right,
                         std::uint64_t below_left, std::uint64_t below_right) {
  CornerWords words;
  words.edges[kLeft] = above_left & ~below_left;
  words.edges[kUp] = above_right & ~above_left;
  words.edges[kDown] = below_left & ~below_right;
  words.edges[kRight] = below_right & ~above_right;
  const std::uint64_t left = above_left ^ below_left, right = above_right ^ below_right;
  const std::uint64_t above = above_left ^ above_right, below = below_left ^ below_right;
  words.turns = (left | right) & (above | below);
  words.crossings = left & right & above & below;
  return words;
}

// The corners where outlines turn. An edge from one runs straight to the next one in its row or
// column. Corners are numbered row by row.
class Turns {
 public:
  explicit Turns(const Bitmap& bitmap) {
    const auto height = static_cast<std::size_t>(bitmap.height());
    const auto width = static_cast<std::size_t>(bitmap.width());
    const std::vector<std::uint64_t> free_row(bitmap.words_per_row());
    for (std::size_t row = 0; row <= height; ++row) {
      const std::uint64_t* const above = row > 0 ? bitmap.Row(row - 1) : free_row.data();
      const std::uint64_t* const below = row < height ? bitmap.Row(row) : free_row.data();
      AddRow(row, above, below, width);
    }
    SortByColumn(width);
  }

  std::vector<std::vector<point_t>> ExtractPolygons() {
    std::vector<std::vector<point_t>> polygons;
    for (const std::uint32_t turn : by_column_) {
      while (turns_[turn].edges != 0) polygons.push_back(ExtractPolygon(turn));
    }
    return polygons;
  }

 private:
  struct Turn {
    std::uint16_t x, row;
    std::uint32_t column_place;  // index in by_column_
    std::uint8_t edges;          // edges not yet in a polygon, one bit per direction
  };

  // Adds the corners between two rows of pixels.
  void AddRow(std::size_t row, const std::uint64_t* above, const std::uint64_t* below,
              std::size_t width) {
    std::uint64_t last_above = 0, last_below = 0;
    for (std::size_t x = 0; x <= width; x += 64) {
      // The last corner may lie past the last word of pixels.
      const std::uint64_t right_above = x < width ? above[x / 64] : 0;
      const std::uint64_t right_below = x < width ? below[x / 64] : 0;
      AddCorners(x, row,
                 CornersAmong(right_above << 1 | last_above >> 63, right_above,
                              right_below << 1 | last_below >> 63, right_below));
      last_above = right_above;
      last_below = right_below;
    }
  }

  void AddCorners(std::size_t x, std::size_t row, const CornerWords& words) {
    count_ += static_cast<std::size_t>(std::popcount(words.turns) + std::popcount(words.crossings));
    if (count_ > kMaxCorners) {
      throw LoadError("found outlines with more than " + std::to_string(kMaxCorners) +
                          " corners, expected a floor plan; remove its speckle or scale it down",
                      255);
    }
    for (std::uint64_t left = words.turns; left != 0; left &= left - 1) {
      const auto bit = static_cast<unsigned>(std::countr_zero(left));
      unsigned edges = 0;
      for (unsigned direction = 0; direction < 4; ++direction) {
        edges |= static_cast<unsigned>(words.edges[direction] >> bit & 1) << direction;
      }
      turns_.push_back({static_cast<std::uint16_t>(x + bit), static_cast<std::uint16_t>(row), 0,
                        static_cast<std::uint8_t>(edges)});
    }
  }

  void SortByColumn(std::size_t width) {
    std::vector<std::uint32_t> next(width + 2);  // next free index per column
    for (const Turn& turn : turns_) ++next[turn.x + 1U];
    for (std::size_t x = 1; x < next.size(); ++x) next[x] += next[x - 1];
    by_column_.resize(turns_.size());
    for (std::uint32_t i = 0; i < turns_.size(); ++i) {
      turns_[i].column_place = next[turns_[i].x]++;
      by_column_[turns_[i].column_place] = i;
    }
  }

  // A straight edge has corners only at its ends, with the exceptions that trace.hh promises: the
  // first and the last step stay separate, so there is a corner one pixel after the start and one
  // pixel before the end.
  std::vector<point_t> ExtractPolygon(std::uint32_t start) {
    std::vector<point_t> polygon{PointOf(turns_[start], kRight, 0)};
    for (std::uint32_t at = start;;) {
      const Turn from = turns_[at];
      const Direction direction = ExtractEdge(&at);
      const Turn& to = turns_[at];
      const int length = std::abs(to.x - from.x) + std::abs(to.row - from.row);
      if (polygon.size() == 1 && length > 1) polygon.push_back(PointOf(from, direction, 1));
      if (to.edges == 0) {
        if (length > 1) polygon.push_back(PointOf(to, direction, -1));
        return polygon;
      }
      polygon.push_back(PointOf(to, direction, 0));
    }
  }

  // Removes the first edge of a turn and moves to the turn at its other end.
  Direction ExtractEdge(std::uint32_t* at) {
    Turn& turn = turns_[*at];
    const auto direction = static_cast<Direction>(std::countr_zero(turn.edges));
    turn.edges &= static_cast<std::uint8_t>(turn.edges - 1);
    switch (direction) {
      case kLeft:
        *at -= 1;
        break;
      case kUp:
        *at = by_column_[turn.column_place - 1];
        break;
      case kDown:
        *at = by_column_[turn.column_place + 1];
        break;
      case kRight:
        *at += 1;
        break;
    }
    return direction;
  }

  // The point `steps` pixels from the turn.
  static point_t PointOf(const Turn& turn, Direction direction, int steps) {
    static constexpr int kX[] = {-1, 0, 0, 1}, kRow[] = {0, -1, 1, 0};
    // Negated as an integer, so that the top row is at 0 instead of -0.
    return point_t(turn.x + kX[direction] * steps, -(turn.row + kRow[direction] * steps));
  }

  std::vector<Turn> turns_;
  std::vector<std::uint32_t> by_column_;  // indices of turns, sorted by x, then by row
  std::size_t count_ = 0;                 // corners of all polygons
};

}  // namespace

std::vector<std::vector<point_t>> Trace(const Bitmap& bitmap) {
  return Turns(bitmap).ExtractPolygons();
}

namespace {

Outlines OutlinesOf(const Bitmap& bitmap, const std::string& name) {
  try {
    return {Trace(bitmap), bitmap.width(), bitmap.height()};
  } catch (const LoadError& error) {
    throw LoadError(name + ": " + error.what(), error.exit_status());
  }
}

}  // namespace

Outlines OutlinesOf(const std::string& path) { return OutlinesOf(Load(path), path); }

Outlines OutlinesOf(const std::string& content, const std::string& name) {
  return OutlinesOf(LoadFromMemory(content.data(), content.size(), name), name);
}

}  // namespace picture

int polys_from_image_file(const std::string& filename, std::vector<std::vector<point_t>>& polys) {
  try {
    polys = picture::OutlinesOf(filename).polygons;
    return 0;
  } catch (const std::exception& error) {  // including bad_alloc for the polygons
    messages::Report(LogLevel::kError, error.what());
    return 1;
  }
}

}  // namespace Stg
