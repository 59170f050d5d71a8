// SPDX-License-Identifier: GPL-2.0-or-later
//
// Spatial index of points in the plane: finds those near a point without examining all.

#ifndef STAGE_MODELS_TYPES_PLACE_INDEX_HH
#define STAGE_MODELS_TYPES_PLACE_INDEX_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class PlaceIndex {
 public:
  /// Replaces all points, which must be finite. Costs little if they are equal to the present ones.
  /// Afterwards *points has unspecified content; its memory is reused.
  void Replace(std::vector<point_t>* points);
  void Clear();
  size_t size() const { return points_.size(); }

  /// Returns the indices of points whose x and y lie within +-reach of the given point, in
  /// ascending order. Valid until this thread's next call. The cost depends on the number of nearby
  /// points, not of all.
  const std::vector<uint32_t>& Near(double x, double y, double reach) const;

 private:
  // The plane is divided into strips along y. Points are sorted by strip, then by y.
  struct Place {
    double strip, y;
    uint32_t point;
    bool operator<(const Place& o) const;
  };

  std::vector<point_t> points_;
  std::vector<Place> places_;  // one for each point; sorted
};

}  // namespace Stg

#endif
