// SPDX-License-Identifier: GPL-2.0-or-later
//
// Shapes of bodies as triangles and lines. Models with equal bodies share one shape.

#ifndef STAGE_GUI_DRAW_SHAPE_HH
#define STAGE_GUI_DRAW_SHAPE_HH

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {
class BlockGroup;
}

namespace Stg::draw {

struct Corner {
  float x, y, z;
};

/// Geometry in the model's frame, metres.
struct Shape {
  uint64_t id = 0;             ///< unique within the process
  std::vector<Corner> faces;   ///< three per triangle: tops, filled odd-even per height; then sides
  std::vector<Corner> edges;   ///< two corners per line
  std::vector<Corner> nose;    ///< a triangle that points ahead, at z = 0; may be empty
  double radius = 0;           ///< of the smallest sphere about the model's origin
  double reach = 0;            ///< of the smallest circle about the model's origin in plan view
  double top = 0, bottom = 0;  ///< z range
};

/// Makes the shape of a body. `frame` is the body's frame in the model's frame.
std::shared_ptr<const Shape> MakeShape(const BlockGroup& body, const Pose& frame);

/// Cache of the shapes in use, so that equal bodies share one.
class ShapeStore {
 public:
  std::shared_ptr<const Shape> Find(const BlockGroup& body, const Pose& frame);
  /// Drops entries whose shape is no longer in use.
  void Tidy();
  std::size_t size() const { return shapes_.size(); }

 private:
  std::unordered_map<std::string, std::weak_ptr<const Shape>> shapes_;  // keyed by geometry
};

}  // namespace Stg::draw

#endif
