// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/place_index.hh"

#include <algorithm>

#include "messages/assert.hh"

namespace Stg {

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
    places_.push_back({StripAt((*points)[i].x), (*points)[i].y, (*points)[i].x, i});
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
  ForEachNear(x, y, reach, [](uint32_t point, double, double) { near.push_back(point); });
  std::sort(near.begin(), near.end());
  return near;
}

}  // namespace Stg
