// SPDX-License-Identifier: GPL-2.0-or-later
//
// How much of a straight line runs inside bodies: exact geometry, where the grid knows outlines
// only.

#ifndef STAGE_MODELS_LINE_IN_BODIES_HH
#define STAGE_MODELS_LINE_IN_BODIES_HH

#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class Block;
class Model;

class LineInBodies {
 public:
  /// A new line, between two global points.
  void Begin(const point3_t& from, const point3_t& to);
  void AddBodyOf(const Model& model);
  /// The share of the line, 0 to 1, that is inside of any body added, bodies that overlap counted
  /// once.
  double ShareInside();
  /// Where, from 0 to 1, the line first is inside of a body; 1 if it is nowhere.
  double FirstInside() const;

 private:
  struct Crossing {
    double along;  // the line: 0 is its start, 1 its end
    int turns;     // what the winding number of the body's outlines changes by
    bool operator<(const Crossing& o) const { return along < o.along; }
  };
  void AddBlock(const Block& block, const point_t& from, const point_t& to, const Bounds& part);
  Bounds PartBetween(const Bounds& heights) const;
  void AddInsides();

  point3_t from_, to_;
  std::vector<Crossing> crossings_;  // of one body
  std::vector<Bounds> insides_;      // of all bodies
};

}  // namespace Stg

#endif
