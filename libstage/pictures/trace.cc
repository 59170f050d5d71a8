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

// Computes the corners from the four pixels around each. An edge separates a solid pixel, on its
// right, from a free one (rows count downwards).
Tracer::CornerWords CornersAmong(std::uint64_t above_left, std::uint64_t above_right,
                                 std::uint64_t below_left, std::uint64_t below_right) {
  Tracer::CornerWords words;
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

}  // namespace

// ---- corners where outlines turn ----------------------------------------------------------------

// Adds the corners between two rows of pixels.
void Tracer::AddRow(std::size_t row, const std::uint64_t* above, const std::uint64_t* below,
                    std::size_t width) {
  std::uint64_t last_above = 0, last_below = 0;
  for (std::size_t x = 0; x <= width; x += 64) {
    // The last corner may lie past the last word of pixels.
    const std::uint64_t right_above = x < width && above ? above[x / 64] : 0;
    const std::uint64_t right_below = x < width && below ? below[x / 64] : 0;
    AddCorners(x, row,
               CornersAmong(right_above << 1 | last_above >> 63, right_above,
                            right_below << 1 | last_below >> 63, right_below));
    last_above = right_above;
    last_below = right_below;
  }
}

void Tracer::AddCorners(std::size_t x, std::size_t row, const CornerWords& words) {
  if (words.turns == 0) return;  // outlines turn at crossings, too
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

void Tracer::SortByColumn(std::size_t width) {
  next_.assign(width + 2, 0);  // next free index per column
  for (const Turn& turn : turns_) ++next_[turn.x + 1U];
  for (std::size_t x = 1; x < next_.size(); ++x) next_[x] += next_[x - 1];
  by_column_.resize(turns_.size());
  for (std::uint32_t i = 0; i < turns_.size(); ++i) {
    turns_[i].column_place = next_[turns_[i].x]++;
    by_column_[turns_[i].column_place] = i;
  }
}

// ---- outlines -----------------------------------------------------------------------------------

namespace {

// The point `steps` pixels from a corner.
Tracer::Corner Beside(Tracer::Corner corner, Direction direction, int steps) {
  static constexpr int kX[] = {-1, 0, 0, 1}, kRow[] = {0, -1, 1, 0};
  return {corner.x + kX[direction] * steps, corner.row + kRow[direction] * steps};
}

}  // namespace

void Tracer::Trace(const Bitmap& bitmap) {
  turns_.clear();
  corners_.clear();
  ends_.clear();
  count_ = 0;
  const auto height = static_cast<std::size_t>(bitmap.height());
  const auto width = static_cast<std::size_t>(bitmap.width());
  for (std::size_t row = 0; row <= height; ++row) {
    AddRow(row, row > 0 ? bitmap.Row(row - 1) : nullptr, row < height ? bitmap.Row(row) : nullptr,
           width);
  }
  SortByColumn(width);
  for (const std::uint32_t turn : by_column_) {
    while (turns_[turn].edges != 0) ExtractPolygon(turn);
  }
}

// A straight edge has corners only at its ends, with the exceptions that trace.hh promises: the
// first and the last step stay separate, so there is a corner one pixel after the start and one
// pixel before the end.
void Tracer::ExtractPolygon(std::uint32_t start) {
  const std::size_t first = corners_.size();
  corners_.push_back({turns_[start].x, turns_[start].row});
  for (std::uint32_t at = start;;) {
    const Corner from{turns_[at].x, turns_[at].row};
    const auto direction = static_cast<Direction>(ExtractEdge(&at));
    const Corner to{turns_[at].x, turns_[at].row};
    const int length = std::abs(to.x - from.x) + std::abs(to.row - from.row);
    if (corners_.size() == first + 1 && length > 1) corners_.push_back(Beside(from, direction, 1));
    if (turns_[at].edges == 0) {
      if (length > 1) corners_.push_back(Beside(to, direction, -1));
      ends_.push_back(static_cast<std::uint32_t>(corners_.size()));
      return;
    }
    corners_.push_back(to);
  }
}

// Removes the first edge of a turn, moves to the turn at its other end, and returns its direction.
unsigned Tracer::ExtractEdge(std::uint32_t* at) {
  Turn& turn = turns_[*at];
  const auto direction = static_cast<unsigned>(std::countr_zero(turn.edges));
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
    default:
      *at += 1;
      break;
  }
  return direction;
}

std::vector<std::vector<point_t>> Trace(const Bitmap& bitmap) {
  Tracer tracer;
  tracer.Trace(bitmap);
  std::vector<std::vector<point_t>> polygons;
  std::size_t first = 0;
  for (const std::uint32_t end : tracer.ends()) {
    std::vector<point_t>& polygon = polygons.emplace_back();
    // Negated as an integer, so that the top row is at 0 instead of -0.
    for (; first < end; ++first)
      polygon.emplace_back(tracer.corners()[first].x, -tracer.corners()[first].row);
  }
  return polygons;
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
