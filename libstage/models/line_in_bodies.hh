// SPDX-License-Identifier: GPL-2.0-or-later
//
// Computes how much of a straight line is inside bodies, with exact geometry; the grid has outlines
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
  /// Starts a new line between two global points.
  void Begin(const point3_t& from, const point3_t& to);
  void AddBodyOf(const Model& model);
  /// Fraction of the line, 0 to 1, that is inside of at least one of the added bodies.
  double FractionInside();
  /// Fraction of the line, 0 to 1, at which it first enters a body; 1 if it enters none.
  double FirstInside() const;

 private:
  struct Crossing {
    double along;  // fraction of the line: 0 is its start, 1 its end
    int turns;     // change of the outlines' winding number
    bool operator<(const Crossing& o) const { return along < o.along; }
  };
  void AddBlock(const Block& block, const point_t& from, const point_t& to, const Bounds& part);
  Bounds IntervalBetween(const Bounds& heights) const;
  void AddInsides();

  point3_t from_, to_;
  std::vector<Crossing> crossings_;  // of the current body
  std::vector<Bounds> insides_;      // of all bodies added
};

}  // namespace Stg

#endif
