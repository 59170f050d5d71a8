// SPDX-License-Identifier: GPL-2.0-or-later
//
// The exact ray model for a single ray: finds the outline that the ray meets first.

#ifndef STAGE_SENSING_EXACT_VISIT_HH
#define STAGE_SENSING_EXACT_VISIT_HH

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "grid/grid.hh"
#include "messages/assert.hh"
#include "sensing/crossing.hh"
#include "sensing/fan.hh"
#include "sensing/ray_record.hh"

namespace Stg::internal::sensing {

inline bool PassesAboveOrBelow(const Fan& fan, const grid::Body& body) {
  return fan.z_test && (fan.z < body.z_min || fan.z > body.z_max);
}

/// Orders hits by distance. At equal distance the body with the smaller number wins, independent of
/// the order of the visits.
inline bool IsNearer(double along, const grid::Body& body, double nearest,
                     const grid::Body& other) {
  return along < nearest || (along == nearest && body.number < other.number);
}

/// Inclusive: a hit exactly at the range counts.
inline bool IsWithin(double along, double range) { return along <= range && std::isfinite(along); }

/// Records nothing and compiles to nothing.
struct NullRecorder {
  void Leg(double, const ray_t&) const {}
  void Cell(const ray_t&) const {}
  void Body(const grid::Body&, RayRecord::Answer, double = 0) const {}
};

/// Visits the cells along a ray and intersects the ray with the outlines in their tiles, until no
/// further cell can hold a nearer crossing.
template <class Recorder = NullRecorder>
class ExactVisit {
 public:
  ExactVisit(const grid::Grid& grid, const Fan& fan, const Line& line,
             const Recorder& recorder = {})
      : grid_(grid), fan_(fan), line_(line), nearest_(fan.range), recorder_(recorder) {}

  /// The body that the ray meets, or null, and its distance in metres.
  const grid::Body* hit_body() const { return hit_; }
  double range() const { return nearest_; }
  RayHit hit() const { return {nearest_, hit_ ? hit_->model : nullptr}; }
  /// True if a leg that starts `leg_start` metres from the ray's start cannot change the result.
  bool IsDoneBefore(double leg_start) const { return hit_ && nearest_ <= leg_start; }
  void BeginLeg(double leg_start) { leg_start_ = leg_start; }

  /// Returns true to end the walk.
  bool operator()(ray_t* ray, uint32_t region, uint32_t tile, uint32_t) {
    const auto slot = static_cast<uint32_t>(grid::Grid::CellAt(region, tile, 0) >> 6);
    if (slot == tested_slot_) return false;
    recorder_.Cell(*ray);
    if (!TestTile(slot)) return false;
    EndAtNearest(ray);
    return PastLimits(*ray, ray->u + 1, ray->v) && PastLimits(*ray, ray->u, ray->v + 1);
  }
  /// Returns true if an outline in the tile is nearer than the nearest one so far.
  bool TestTile(uint32_t slot) {
    tested_slot_ = slot;
    bool nearer = false;
    grid_.ForEachOutline(grid_.OutlinesIn(slot), [&](const grid::OutlineFragment& outline) {
      nearer |= TestOutline(outline);
    });
    return nearer;
  }
  /// Sets a known hit, unless it is null.
  void SetHit(const grid::Body* hit_body, double along) {
    if (hit_body) StopAt(*hit_body, along);
  }
  /// Ends the walk at the nearest crossing: cells behind it do not matter.
  void EndAtNearest(ray_t* ray) const {
    if (!hit_) return;
    const double leg_fraction = FractionOfLeg(nearest_ - leg_start_, fan_.leg_length);
    ray->limit_x = std::min(ray->limit_x, BorderLimit(leg_fraction, ray->adx));
    ray->limit_y = std::min(ray->limit_y, BorderLimit(leg_fraction, ray->ady));
  }

 private:
  /// Returns true and stores the body if this fragment of it is the nearest hit so far.
  bool TestOutline(const grid::OutlineFragment& outline) {
    const grid::Body& body = grid_.body(outline.id);
    if (PassesAboveOrBelow(fan_, body)) return Reject(body, RayRecord::Answer::kOtherHeight);
    if (PassesBy(line_, point_t(body.x, body.y), body.radius, nearest_))
      return Reject(body, RayRecord::Answer::kMissed);
    const double along = FirstCrossing(line_, body.corners, outline.edges);
    if (!IsNearer(body, along)) return Reject(body, RayRecord::Answer::kMissed);
    STAGE_ASSERT(fan_.predicate && body.model && body.exact());
    if (!fan_.predicate(body.model, fan_.finder, fan_.arg))
      return Reject(body, RayRecord::Answer::kRejected, along);
    recorder_.Body(body, RayRecord::Answer::kAccepted, along);
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
  bool Reject(const grid::Body& body, RayRecord::Answer answer, double along = 0) const {
    recorder_.Body(body, answer, along);
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
  uint32_t tested_slot_ = 0;  // slot of the tile that was tested last
  [[no_unique_address]] const Recorder recorder_;
};

}  // namespace Stg::internal::sensing

#endif
