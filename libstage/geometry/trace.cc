// SPDX-License-Identifier: GPL-2.0-or-later
#include "geometry/trace.hh"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <stdexcept>

#include "geometry/image_polygons.hh"

namespace Stg {
namespace picture {
namespace {

// The unit edges that can leave a corner, in the order of the corners they lead to (x, then row).
enum Direction : unsigned { kLeft, kUp, kDown, kRight };

// The edges that leave a corner, one bit for each direction, by the four pixels around the corner
// (bits 3 to 0: above left, above right, below left, below right; 1 is solid). Solid is on the
// right of an edge (rows count downwards), and there is none between two solid pixels.
constexpr std::array<std::uint8_t, 16> EdgesOfCorners() {
  std::array<std::uint8_t, 16> edges{};
  for (unsigned pixels = 0; pixels < edges.size(); ++pixels) {
    const unsigned above_left = pixels >> 3 & 1U, above_right = pixels >> 2 & 1U;
    const unsigned below_left = pixels >> 1 & 1U, below_right = pixels & 1U;
    edges[pixels] = static_cast<std::uint8_t>(
        (above_left & ~below_left) << kLeft | (above_right & ~above_left) << kUp |
        (below_left & ~below_right) << kDown | (below_right & ~above_right) << kRight);
  }
  return edges;
}

constexpr std::array<std::uint8_t, 16> kEdgesOfCorner = EdgesOfCorners();

// The edges that are not yet part of a polygon. Corners are kept column by column, so that
// increasing indices are the order in which polygons start.
class Edges {
 public:
  Edges(const Raster& raster, std::uint8_t threshold)
      : column_(static_cast<std::size_t>(raster.height) + 1),
        at_corner_(column_ * (static_cast<std::size_t>(raster.width) + 1)) {
    // Flags of two rows of pixels, with a free pixel at either end; free rows above and below.
    const std::size_t width = static_cast<std::size_t>(raster.width);
    std::vector<std::uint8_t> above(width + 2), below(width + 2);
    for (std::size_t row = 0; row < column_; ++row) {
      std::swap(above, below);
      if (row + 1 < column_) {
        const std::uint8_t* const samples = raster.samples.data() + row * width;
        std::transform(samples, samples + width, below.begin() + 1, [threshold](std::uint8_t s) {
          return static_cast<std::uint8_t>(s <= threshold);
        });
      } else {
        std::fill(below.begin(), below.end(), std::uint8_t{0});
      }
      AddCorners(row, above, below);
    }
  }

  std::vector<std::vector<point_t>> TakePolygons() {
    std::vector<std::vector<point_t>> polygons;
    for (std::size_t corner = 0; corner < at_corner_.size(); ++corner) {
      while (at_corner_[corner] != 0) polygons.push_back(TakePolygon(corner));
    }
    return polygons;
  }

 private:
  void AddCorners(std::size_t row, const std::vector<std::uint8_t>& above,
                  const std::vector<std::uint8_t>& below) {
    for (std::size_t x = 0; x + 1 < above.size(); ++x) {
      const unsigned pixels =
          static_cast<unsigned>(above[x] << 3 | above[x + 1] << 2 | below[x] << 1 | below[x + 1]);
      // Most corners have no edge; not touching those keeps this loop in the cache.
      if (kEdgesOfCorner[pixels] != 0) at_corner_[x * column_ + row] = kEdgesOfCorner[pixels];
    }
  }

  std::vector<point_t> TakePolygon(std::size_t corner) {
    std::vector<point_t> polygon;
    unsigned step = kLeft, step_before = kLeft;
    while (at_corner_[corner] != 0) {
      if (polygon.size() > 2 && step == step_before) {
        polygon.back() = PointOf(corner);
      } else {
        polygon.push_back(PointOf(corner));
      }
      step_before = step;
      step = TakeEdge(corner);
    }
    return polygon;
  }

  // Removes the first edge of the corner, moves on to the corner where it ends.
  unsigned TakeEdge(std::size_t& corner) {
    const unsigned edges = at_corner_[corner];
    const unsigned direction = static_cast<unsigned>(std::countr_zero(edges));
    at_corner_[corner] = static_cast<std::uint8_t>(edges & (edges - 1));
    switch (direction) {
      case kLeft:
        corner -= column_;
        break;
      case kUp:
        corner -= 1;
        break;
      case kDown:
        corner += 1;
        break;
      default:
        corner += column_;
        break;
    }
    return direction;
  }

  point_t PointOf(std::size_t corner) const {
    // Negated as an integer: the top row is at 0, not at the floating point -0.
    return point_t(static_cast<meters_t>(corner / column_),
                   static_cast<meters_t>(-static_cast<std::ptrdiff_t>(corner % column_)));
  }

  std::size_t column_;  // corners in a column
  std::vector<std::uint8_t> at_corner_;
};

}  // namespace

std::vector<std::vector<point_t>> Trace(const Raster& raster, std::uint8_t threshold) {
  if (raster.width < 0 || raster.height < 0 ||
      raster.samples.size() !=
          static_cast<std::size_t>(raster.width) * static_cast<std::size_t>(raster.height)) {
    throw std::invalid_argument("picture::Trace: the raster has not width * height samples");
  }
  return Edges(raster, threshold).TakePolygons();
}

}  // namespace picture

int polys_from_image_file(const std::string& filename, std::vector<std::vector<point_t>>& polys) {
  try {
    polys = picture::Trace(picture::Load(filename));
    return 0;
  } catch (const std::exception& error) {  // also memory that does not suffice for the polygons
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

}  // namespace Stg
