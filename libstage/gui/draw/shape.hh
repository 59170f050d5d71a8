// SPDX-License-Identifier: GPL-2.0-or-later
//
// The shapes of bodies, as triangles and lines. Models with equal bodies share one shape.

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

/// In the model's frame, metres.
struct Shape {
  uint64_t id = 0;            ///< unique in the process
  std::vector<Corner> faces;  ///< three for each triangle: tops, those of blocks of one
  ///< height filled together by the odd-even rule, then sides
  std::vector<Corner> edges;   ///< two for each line
  std::vector<Corner> nose;    ///< a triangle that points ahead, at z = 0; none: empty
  double radius = 0;           ///< of a ball about the model's origin that holds it
  double reach = 0;            ///< of a circle about the model's origin that holds it in plan
  double top = 0, bottom = 0;  ///< heights
};

/// Makes a shape; `frame` is where the body lies in the model's frame.
std::shared_ptr<const Shape> MakeShape(const BlockGroup& body, const Pose& frame);

/// Finds the shape of a body among those in use, or makes it.
class ShapeStore {
 public:
  std::shared_ptr<const Shape> Find(const BlockGroup& body, const Pose& frame);
  /// Forgets shapes that nobody has any more.
  void Tidy();
  std::size_t size() const { return shapes_.size(); }

 private:
  std::unordered_map<std::string, std::weak_ptr<const Shape>> shapes_;  // by what they are made of
};

}  // namespace Stg::draw

#endif
