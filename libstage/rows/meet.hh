// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays of a fan against the outlines of movers; part of stepper.hh for the files that trace.

#ifndef STAGE_ROWS_MEET_HH
#define STAGE_ROWS_MEET_HH

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rows/stepper.hh"
#include "sensing/crossing.hh"
#include "sensing/exact_visit.hh"
#include "sensing/middle.hh"

namespace Stg::rows {

/// The place of a ray that hits nothing.
inline constexpr int32_t kNowhere = std::numeric_limits<int32_t>::max();

/// The smallest number among the bodies in a cell is hit first. Robots that have moved come after
/// everything that has not. See Body::loading_stamp.
inline uint64_t Rows::Stepper::DrawingOrder(uint32_t body) const {
  constexpr uint64_t kMovedSinceLoading = uint64_t{1} << 62;
  const uint64_t stamp = c_.stamp[body_ + body];
  return stamp > 0 ? kMovedSinceLoading + stamp : scene_.bodies[body].loading_stamp;
}

/// Calls f(i, ray, u, v) for each ray i of a fan that meets the outline of a body, in the cell
/// behind u borders of columns and v borders of rows.
template <class Word, typename F>
void Rows::Stepper::ForEachMeeting(const internal::sensing::Fan& fan, const RaysOfSensor& rays,
                                   uint32_t count, uint32_t number, F f) const {
  namespace sensing = internal::sensing;
  const Body& body = scene_.bodies[number];
  const OutlineBox& box = c_.box[body_ + number];
  if (box.height == 0) return;
  const Word* const rows = BitsOf<Word>(number);
  // The body's circle in the frame of the fan, in cells. Single precision suffices to omit rays
  // that pass it.
  const Planar& at = c_.pose[mover_ + body.mover];
  const auto cells = static_cast<float>(scene_.cells_per_metre);
  const auto ax = static_cast<float>(at.x - fan.x) * cells;
  const auto ay = static_cast<float>(at.y - fan.y) * cells;
  const auto cosine = static_cast<float>(fan.heading.cosine);
  const auto sine = static_cast<float>(fan.heading.sine);
  const float ahead = cosine * ax + sine * ay, aside = cosine * ay - sine * ax;
  const float margin = static_cast<float>(body.radius) * cells * 1.001f + 3.0f;
  for (uint32_t i = 0; i < count; i++) {
    const float c = static_cast<float>(rays.unit_vectors[i].cosine);
    const float s = static_cast<float>(rays.unit_vectors[i].sine);
    if (std::fabs(c * aside - s * ahead) > margin || c * ahead + s * aside < -margin) continue;
    const sensing::Displacement way = sensing::DisplacementOf(fan.record, rays.directions[i]);
    const CellRay ray(fan.record.x, fan.record.y,
                      static_cast<int32_t>(fan.record.fraction & 0xffff),
                      static_cast<int32_t>(fan.record.fraction >> 16), way.x, way.y);
    int32_t u, v;
    if (MeetOutline(box, rows, ray, &u, &v)) f(i, ray, u, v);
  }
}

/// The range of a ray of a fan that ends in the cell behind these borders, in metres.
inline double RangeAt(const internal::sensing::Fan& fan, const CellRay& ray, int32_t u, int32_t v) {
  const internal::sensing::Passage passage{(u << 16) - ray.ox, (v << 16) - ray.oy, ray.adx,
                                           ray.ady};
  return internal::sensing::MiddleOf(passage) * fan.leg_length;
}

/// Calls f(i, distance) for each ray i of a fan that may cross the outline of a body before
/// range(i); the distance may be infinite. See ExactVisit.
template <typename Range, typename F>
void Rows::Stepper::ForEachCrossing(const internal::sensing::Fan& fan, const RaysOfSensor& rays,
                                    uint32_t count, const Body& body, Range range, F f) const {
  namespace sensing = internal::sensing;
  constexpr uint32_t kEdges = 8;
  const Planar& at = c_.pose[mover_ + body.mover];
  const point_t* const points = &s_.points[body.first_point];
  const auto edges = static_cast<uint32_t>(body.corners.size());
  for (uint32_t i = 0; i < count; i++) {
    const sensing::Line line = sensing::LineOf(fan, rays.unit_vectors[i]);
    if (sensing::PassesBy(line, point_t(at.x, at.y), body.radius, range(i))) continue;
    double along = std::numeric_limits<double>::infinity();
    for (uint32_t first = 0; first < edges; first += kEdges) {
      const uint32_t part = std::min(kEdges, edges - first);
      along = std::min(along, sensing::FirstCrossing(line, points + first, (1u << part) - 1));
    }
    f(i, along);
  }
}

/// True if a crossing after `along` metres, with the model of id `key`, comes before the present
/// hit, if there is one. See ExactVisit::IsNearer().
inline bool IsNearer(double along, uint64_t key, bool has_hit, double range, uint64_t key_of_hit) {
  return has_hit ? along < range || (along == range && key < key_of_hit)
                 : internal::sensing::IsWithin(along, range);
}

/// True if the body is too far away for the rays of a fan.
inline bool Rows::Stepper::IsOutOfReach(const internal::sensing::Fan& fan, const Body& body) const {
  const double margin = 3 / scene_.cells_per_metre;
  const Planar& at = c_.pose[mover_ + body.mover];
  const double dx = at.x - fan.x, dy = at.y - fan.y, far = fan.range + body.radius + margin;
  return dx * dx + dy * dy > far * far;
}

/// Continues a ray behind the cell `hit`, among what stands, until accept(bodies of a cell). Stores
/// range and place of that cell; returns false if there is none. See Tracer::Follow().
template <typename Accept>
bool Rows::Stepper::FollowRay(const internal::sensing::Fan& fan,
                              const internal::sensing::Direction& direction, uint32_t hit,
                              Accept accept, double* range, int32_t* place) const {
  namespace sensing = internal::sensing;
  namespace grid = internal::grid;
  const ray_grid_t view = scene_.grid.View(fan.layer);
  const ray_mask_t no_mask{};
  ray_t ray;
  sensing::BeginRay(view, fan.record, sensing::DisplacementOf(fan.record, direction), &ray);
  ray_resume(&ray, ray_packed_u(hit), ray_packed_v(hit));
  while (ray_next(&view, &no_mask, &ray)) {
    const grid::CellRef cell = grid::Grid::CellAt(ray.region, ray.tile, ray.bit);
    if (!accept(scene_.grid.ListIn(cell))) continue;
    *range = sensing::MiddleOf(sensing::PassageOf(ray)) * fan.leg_length;
    *place = ray.u + ray.v;
    return true;
  }
  return false;
}

}  // namespace Stg::rows

#endif
