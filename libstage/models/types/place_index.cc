// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/place_index.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "messages/assert.hh"

namespace Stg {

namespace {

/// Metres. Half the usual range of a fiducial finder: it then searches five strips and few points
/// too far left or right.
constexpr double kStripWidth = 4.0;

double StripAt(double x) { return std::floor(x / kStripWidth); }

}  // namespace

bool PlaceIndex::Place::operator<(const Place& o) const {
  if (strip != o.strip) return strip < o.strip;
  if (y != o.y) return y < o.y;
  return point < o.point;
}

void PlaceIndex::Replace(std::vector<point_t>* points) {
  if (*points == points_ && places_.size() == points_.size()) return;
  places_.clear();
  places_.reserve(points->size());  // throws here or not at all: never are there too few places
  for (uint32_t i = 0; i < points->size(); i++)
    places_.push_back({StripAt((*points)[i].x), (*points)[i].y, i});
  std::sort(places_.begin(), places_.end());
  points_.swap(*points);
}

void PlaceIndex::Clear() {
  points_.clear();
  places_.clear();
}

const std::vector<uint32_t>& PlaceIndex::Near(double x, double y, double reach) const {
  STAGE_ASSERT(places_.size() == points_.size());
  static thread_local std::vector<uint32_t> near;  // static to reuse its memory
  near.clear();
  if (!std::isfinite(x) || !std::isfinite(y) || !(reach >= 0)) return near;
  const double last_strip = StripAt(x + reach);
  const Place from{StripAt(x - reach), y - reach, 0};
  auto place = std::lower_bound(places_.begin(), places_.end(), from);
  while (place != places_.end() && place->strip <= last_strip) {
    const double strip = place->strip;
    // `place` may be in a later strip than intended, so the search in its strip starts here.
    place = std::lower_bound(place, places_.end(), Place{strip, y - reach, 0});
    for (; place != places_.end() && place->strip == strip && place->y <= y + reach; ++place)
      if (std::fabs(points_[place->point].x - x) <= reach) near.push_back(place->point);
    // Next strip. nextafter() because adding 1 has no effect on very large numbers.
    const double beyond = std::nextafter(strip, std::numeric_limits<double>::infinity());
    place = std::lower_bound(place, places_.end(), Place{beyond, y - reach, 0});
  }
  std::sort(near.begin(), near.end());
  return near;
}

}  // namespace Stg
