// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds free space for discs in the plane.

#ifndef STAGE_GEOMETRY_FREE_FLOOR_HH
#define STAGE_GEOMETRY_FREE_FLOOR_HH

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg::geometry {

/// The floor without the bodies that stand on it. Lengths in metres.
class FreeFloor {
 public:
  /// Adds the outlines of one body. A point inside of an odd number of them is solid: a room is an
  /// outline within the outline of its walls.
  void AddBody(const std::vector<std::vector<point_t>>& outlines);
  bool empty() const { return edges_.empty(); }
  /// Bounding box of all bodies. Precondition: not empty().
  bounds3d_t Bounds() const;

  /// Builds the index; call it after the last AddBody(). `reach` is the largest clearance for
  /// IsClear() and greater than 0.
  void BuildIndex(double reach);
  /// True if no body contains the point or is nearer to it than `clearance`.
  bool IsClear(const point_t& point, double clearance) const;

 private:
  struct Edge {
    point_t from, to;
    uint32_t body;
  };
  using Cell = std::vector<uint32_t>;  // indices of edges

  bool IsNear(const Edge& edge, const point_t& point, double clearance) const;
  bool IsSolid(const point_t& point) const;
  size_t RowOf(double y) const;

  std::vector<Edge> edges_;
  uint32_t bodies_ = 0;
  double cell_ = 1;                          // side of a grid cell
  std::unordered_map<uint64_t, Cell> near_;  // edges whose bounding boxes come near a cell
  std::vector<Cell> rows_;                   // edges that cross a horizontal strip
  double first_row_ = 0, row_height_ = 0;
};

/// Discs that keep a minimum distance from each other.
class Discs {
 public:
  /// `largest_radius` bounds the radius of all discs; `gap` is the minimum distance.
  explicit Discs(double largest_radius, double gap);
  /// Returns false, without adding the disc, if another disc is nearer than the gap.
  bool AddIfClear(const point_t& centre, double radius);

 private:
  struct Disc {
    point_t centre;
    double radius;
  };
  double gap_, cell_;
  std::unordered_map<uint64_t, std::vector<Disc>> discs_;
};

}  // namespace Stg::geometry

#endif
