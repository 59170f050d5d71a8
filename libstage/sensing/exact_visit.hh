// SPDX-License-Identifier: GPL-2.0-or-later
//
// The exact ray model, one ray at a time: what decides what a ray meets.

#ifndef STAGE_SENSING_EXACT_VISIT_HH
#define STAGE_SENSING_EXACT_VISIT_HH

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "grid/grid.hh"
#include "sensing/crossing.hh"
#include "sensing/fan.hh"
#include "sensing/ray_record.hh"

namespace Stg::internal::sensing {

inline bool PassesAboveOrBelow(const Fan& fan, const grid::Body& body) {
  return fan.z_test && (fan.z < body.z_min || fan.z > body.z_max);
}

/// Of bodies that a ray meets at the same place, it stops at that with the smallest number, in
/// whatever order it gets to know them.
inline bool IsNearer(double along, const grid::Body& body, double nearest,
                     const grid::Body& other) {
  return along < nearest || (along == nearest && body.number < other.number);
}

/// The range itself still counts.
inline bool IsWithin(double along, double range) { return along <= range && std::isfinite(along); }

/// Takes no notes of how a ray is traced: nothing is left of it in the code.
struct NoNotes {
  void Leg(double, const ray_t&) const {}
  void Cell(const ray_t&) const {}
  void Body(const grid::Body&, RayRecord::Answer, double = 0) const {}
};

/// Visits the cells that a ray reaches and intersects it with the outlines in their tiles, until no
/// cell to come can hold a nearer crossing: the exact model.
template <class Taking = NoNotes>
class ExactVisit {
 public:
  ExactVisit(const grid::Grid& grid, const Fan& fan, const Line& line, const Taking& notes = {})
      : grid_(grid), fan_(fan), line_(line), nearest_(fan.range), notes_(notes) {}

  /// What the ray meets, null if nothing, and how far away.
  const grid::Body* met() const { return hit_; }
  double range() const { return nearest_; }
  RayHit hit() const { return {nearest_, hit_ ? hit_->model : nullptr}; }
  /// Whether the leg that begins so many metres from the start can change nothing any more.
  bool IsDoneBefore(double leg_start) const { return hit_ && nearest_ <= leg_start; }
  void BeginLeg(double leg_start) { leg_start_ = leg_start; }

  /// True ends the walk.
  bool operator()(ray_t* ray, uint32_t region, uint32_t tile, uint32_t) {
    const auto slot = static_cast<uint32_t>(grid::Grid::CellAt(region, tile, 0) >> 6);
    if (slot == asked_) return false;
    notes_.Cell(*ray);
    if (!Ask(slot)) return false;
    EndAtNearest(ray);
    return PastLimits(*ray, ray->u + 1, ray->v) && PastLimits(*ray, ray->u, ray->v + 1);
  }
  /// True if an outline in the tile is nearer than what was met before.
  bool Ask(uint32_t slot) {
    asked_ = slot;
    bool nearer = false;
    grid_.ForEachOutline(grid_.OutlinesIn(slot),
                         [&](const grid::OutlinePart& part) { nearer |= Offer(part); });
    return nearer;
  }
  /// It is known that the ray meets this outline, if it is not null.
  void Know(const grid::Body* met, double along) {
    if (met) StopAt(*met, along);
  }
  /// Cells that the ray enters behind the nearest crossing are of no interest any more.
  void EndAtNearest(ray_t* ray) const {
    if (!hit_) return;
    const double share = ShareOfLeg(nearest_ - leg_start_, fan_.leg_length);
    ray->limit_x = std::min(ray->limit_x, LimitOf(share, ray->adx));
    ray->limit_y = std::min(ray->limit_y, LimitOf(share, ray->ady));
  }

 private:
  /// Takes note of the body if the ray meets this part of it first.
  bool Offer(const grid::OutlinePart& part) {
    const grid::Body& body = grid_.body(part.id);
    if (PassesAboveOrBelow(fan_, body)) return Decline(body, RayRecord::Answer::kOtherHeight);
    if (PassesBy(line_, point_t(body.x, body.y), body.radius, nearest_))
      return Decline(body, RayRecord::Answer::kMissed);
    const double along = FirstCrossing(line_, body.corners, part.edges);
    if (!IsNearer(body, along)) return Decline(body, RayRecord::Answer::kMissed);
    if (!fan_.predicate(body.model, fan_.finder, fan_.arg))
      return Decline(body, RayRecord::Answer::kRefused, along);
    notes_.Body(body, RayRecord::Answer::kAccepted, along);
    StopAt(body, along);
    return true;
  }
  void StopAt(const grid::Body& body, double along) {
    nearest_ = along;
    hit_ = &body;
  }
  bool IsNearer(const grid::Body& body, double along) const {
    return hit_ ? sensing::IsNearer(along, body, nearest_, *hit_) : IsWithin(along, nearest_);
  }
  bool Decline(const grid::Body& body, RayRecord::Answer answer, double along = 0) const {
    notes_.Body(body, answer, along);
    return false;
  }
  static bool PastLimits(const ray_t& ray, int u, int v) {
    return (u << 16) - ray.ox > ray.limit_x || (v << 16) - ray.oy > ray.limit_y;
  }

  const grid::Grid& grid_;
  const Fan& fan_;
  const Line line_;
  double leg_start_ = 0;
  double nearest_;
  const grid::Body* hit_ = nullptr;
  uint32_t asked_ = 0;  // the tile whose outlines were the last to be asked
  [[no_unique_address]] const Taking notes_;
};

}  // namespace Stg::internal::sensing

#endif
