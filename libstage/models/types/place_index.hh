// SPDX-License-Identifier: GPL-2.0-or-later
//
// Spatial index of points in the plane: finds those near a point without examining all.

#ifndef STAGE_MODELS_TYPES_PLACE_INDEX_HH
#define STAGE_MODELS_TYPES_PLACE_INDEX_HH

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class PlaceIndex {
 public:
  /// Metres. Half the usual range of a fiducial finder: it then searches five strips and few points
  /// too far left or right.
  static constexpr double kUsualStripWidth = 4.0;

  /// Searches are fast if the strip width is not much above or below their reach.
  explicit PlaceIndex(double strip_width = kUsualStripWidth) : strip_width_(strip_width) {}

  /// Replaces all points, which must be finite. Costs little if they are equal to the present ones.
  /// Afterwards *points has unspecified content; its memory is reused.
  void Replace(std::vector<point_t>* points);
  void Clear();
  size_t size() const { return points_.size(); }

  /// Returns the indices of points whose x and y lie within +-reach of the given point, in
  /// ascending order. Valid until this thread's next call. The cost depends on the number of nearby
  /// points, not of all.
  const std::vector<uint32_t>& Near(double x, double y, double reach) const;
  /// Calls f(index, x, y) for these points in any order.
  template <typename F>
  void ForEachNear(double x, double y, double reach, F f) const;

 private:
  // The plane is divided into strips along y. Points are sorted by strip, then by y.
  struct Place {
    double strip, y, x;
    uint32_t point;
    bool operator<(const Place& o) const;
  };

  double StripAt(double x) const { return std::floor(x / strip_width_); }

  double strip_width_;
  std::vector<point_t> points_;
  std::vector<Place> places_;  // one for each point; sorted
};

template <typename F>
void PlaceIndex::ForEachNear(double x, double y, double reach, F f) const {
  if (!std::isfinite(x) || !std::isfinite(y) || !(reach >= 0)) return;
  const double last_strip = StripAt(x + reach);
  auto place =
      std::lower_bound(places_.begin(), places_.end(), Place{StripAt(x - reach), y - reach, 0, 0});
  while (place != places_.end() && place->strip <= last_strip) {
    const double strip = place->strip;
    // `place` may be in a later strip than intended, so the search in its strip starts here.
    if (place->y < y - reach)
      place = std::lower_bound(place, places_.end(), Place{strip, y - reach, 0, 0});
    for (; place != places_.end() && place->strip == strip && place->y <= y + reach; ++place)
      if (std::fabs(place->x - x) <= reach) f(place->point, place->x, place->y);
    // Next strip. nextafter() because adding 1 has no effect on very large numbers.
    const double beyond = std::nextafter(strip, std::numeric_limits<double>::infinity());
    place = std::lower_bound(place, places_.end(), Place{beyond, y - reach, 0, 0});
  }
}

}  // namespace Stg

#endif
