// SPDX-License-Identifier: GPL-2.0-or-later
//
// Outlines of bodies: polygons, convex or not, and discs.
//
// A shape is a list of convex pieces in the frame of its body. A piece is a convex polygon together
// with everything within `radius` of it; a disc is a single corner with a radius, so round robots
// are exactly round. Concave polygons are cut into convex pieces when they are added.
//
// The table consists of plain arrays, which devices can read as they are.

#ifndef STAGE_MOTION_SHAPE_HH
#define STAGE_MOTION_SHAPE_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "motion/vector.hh"

namespace Stg::motion {

/// Heights that a piece takes up, in metres. Pieces touch only if their intervals overlap.
struct Interval {
  double bottom = 0.0, top = 1.0;
};

/// True if two intervals overlap or meet, each lifted by an elevation.
inline bool Meet(const Interval& a, double elevation_a, const Interval& b, double elevation_b) {
  return a.bottom + elevation_a <= b.top + elevation_b &&
         b.bottom + elevation_b <= a.top + elevation_a;
}

/// A convex part of a shape.
struct Piece {
  uint32_t first_corner, corner_count;  // in Shapes::corners, counter-clockwise
  double radius;                        // m
  double core;                          // greatest distance of a corner from the body's origin, m
  Interval height;
};

struct Shape {
  uint32_t first_piece, piece_count;  // in Shapes::pieces
  uint32_t corner_count;              // of all pieces, which are contiguous in Shapes::corners
  double core;                        // greatest distance of a corner from the body's origin, m
  double bound;                       // greatest distance of any point from the body's origin, m
  double arm;  // mean distance of the shape's points from the origin, m; see Columns::arm
};

/// A polygon to be added. It must not intersect itself; otherwise its edges are used, without its
/// interior.
struct Polygon {
  std::span<const Vector> corners;
  Interval height;
};

struct Disc {
  Vector center;
  double radius;
  Interval height;
};

class Shapes {
 public:
  /// Adds a shape and returns its number.
  uint32_t Add(std::span<const Polygon> polygons, std::span<const Disc> discs);
  /// Stores the shape's `corner_count` corners for a body at a pose.
  void PlaceCorners(const Shape& shape, Vector position, double heading, Vector* to) const;

  std::vector<Shape> shapes;
  std::vector<Piece> pieces;
  std::vector<Vector> corners;

 private:
  void AddPiece(std::span<const Vector> corners, double radius, Interval height);
  void AddEdges(const Polygon& polygon);
};

/// Cuts a polygon into convex polygons, counter-clockwise, which are appended to `parts`: first the
/// number of corners of each, then all corners. False if the polygon has no area or intersects
/// itself.
struct ConvexParts {
  std::vector<uint32_t> sizes;
  std::vector<Vector> corners;
};
bool CutConvex(std::span<const Vector> polygon, ConvexParts* parts);

}  // namespace Stg::motion

#endif
