// SPDX-License-Identifier: GPL-2.0-or-later
//
// The outline of a tree of models for contacts: polygons and discs with heights, made from the
// blocks of those bodies that are obstacles.

#ifndef STAGE_MODELS_CONTACT_OUTLINE_HH
#define STAGE_MODELS_CONTACT_OUTLINE_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "motion/shape.hh"
#include "motion/walls.hh"

namespace Stg {

class Model;

struct ContactOutline {
  struct Part {
    const Model* model;
    size_t first_corner, corner_count;
    double radius;  // m; 0: a polygon; otherwise a disc about its only corner
    motion::Interval height;
  };

  /// Sets the outline to that of a tree whose root is at `at`.
  void Find(const Model& root, const Pose& at);
  /// The bottom of the lowest part; 0 if there is none.
  double Bottom() const;
  std::span<const motion::Vector> CornersOf(const Part& part) const {
    return std::span(corners).subspan(part.first_corner, part.corner_count);
  }
  /// Adds the outline to a table of shapes. Returns its number there.
  uint32_t AddTo(motion::Shapes* shapes) const;
  /// Adds the outline of something that stands to walls: an outline there for each part. `group` is
  /// the id of the root.
  void AddTo(motion::Walls* walls, uint32_t group) const;
  /// Two outlines with equal keys have equal shapes.
  std::string Key() const;

  std::vector<motion::Vector> corners;
  std::vector<Part> parts;

 private:
  void AddTree(const Model& model, const Pose& global);
  void AddBody(const Model& model, const Pose& global);
};

}  // namespace Stg

#endif
