// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where there is room for round things in the plane.

#ifndef STAGE_GEOMETRY_FREE_FLOOR_HH
#define STAGE_GEOMETRY_FREE_FLOOR_HH

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg::geometry {

/// The ground less the bodies that stand on it. Lengths in metres.
class FreeFloor {
 public:
  /// The outlines of one body. Where an odd number of them is around a point, it is solid: a room
  /// has an outline within that of its walls.
  void AddBody(const std::vector<std::vector<point_t>>& outlines);
  bool empty() const { return edges_.empty(); }
  /// The smallest rectangle that has all bodies in it. Only if there are some.
  bounds3d_t Bounds() const;

  /// To be called when all bodies are there. `reach`: the largest clearance that will be asked for,
  /// greater than 0.
  void Finish(double reach);
  /// No body at the point, nor nearer than that.
  bool IsFree(const point_t& point, double clearance) const;

 private:
  struct Edge {
    point_t from, to;
    uint32_t body;
  };
  using Cell = std::vector<uint32_t>;  // edges

  bool IsNear(const Edge& edge, const point_t& point, double clearance) const;
  bool IsSolid(const point_t& point) const;
  size_t RowOf(double y) const;

  std::vector<Edge> edges_;
  uint32_t bodies_ = 0;
  double cell_ = 1;                          // side
  std::unordered_map<uint64_t, Cell> near_;  // the edges whose boxes come near a cell
  std::vector<Cell> rows_;                   // the edges that pass a strip of the ground
  double first_row_ = 0, row_height_ = 0;
};

/// Discs that keep apart.
class Discs {
 public:
  /// No disc will be larger than that.
  explicit Discs(double largest_radius, double gap);
  /// False, and nothing is added, if it would come nearer than the gap to another one.
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
