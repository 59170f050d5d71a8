// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/exact_group.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "sensing/exact_visit.hh"

namespace Stg::internal::sensing {

void ExactGroup::Trace(const RayGroup& rays, const SliceData* slices, const FirstHits& first,
                       double* ranges, TraceCounters* counters) {
  rays_ = &rays;
  ranges_ = ranges;
  counters_ = counters;
  std::fill(hit_bodies_, hit_bodies_ + rays.count, nullptr);
  STAGE_ASSERT(rays.exact && rays.count <= RayGroup::kMaxRays);
  uint32_t end = 0;
  for (uint32_t i = 0; i < rays.slice_count; i++) {
    RayInterval interval{slices[i], rays.slices[i].directions, end, end, end};
    end += rays.slices[i].count;
    while (interval.end < end) {
      interval.from = interval.end;
      interval.end = first.EndOfInterval(interval.from);
      const grid::OutlineList outlines = first.Bodies(interval.from);
      if (outlines == FirstHits::kNothing) continue;
      while (interval.end < end && HaveSameOutline(outlines, first.Bodies(interval.end)))
        interval.end = first.EndOfInterval(interval.end);
      Resolve(interval, outlines, first);
    }
  }
}

/// True if both tiles hold the same edges of the same single outline.
bool ExactGroup::HaveSameOutline(grid::OutlineList a, grid::OutlineList b) const {
  if (b == FirstHits::kNothing) return false;
  const grid::OutlineFragment &of_a = grid_.outline(a), &of_b = grid_.outline(b);
  return of_a.next == 0 && of_b.next == 0 && of_a.id == of_b.id && of_a.edges == of_b.edges;
}

void ExactGroup::Resolve(const RayInterval& interval, grid::OutlineList outlines,
                         const FirstHits& first) {
  STAGE_ASSERT(interval.first <= interval.from && interval.from < interval.end &&
               interval.end <= rays_->count);
  counters_->potential_hits += interval.count();
  const uint32_t in_slice = interval.from - interval.first;
  const OutlineRays rays{interval.slice.fan, interval.directions + in_slice,
                         interval.slice.unit_vectors + in_slice, &first.Packed(interval.from),
                         interval.count()};
  Gather(*interval.slice.fan, outlines);
  OutlineHits found{now_, which_, {}};
  if (!bodies_.empty()) {
    first.Meet(rays, {edges_.data(), static_cast<uint32_t>(edges_.size())}, &found);
    StoreHits(interval);
  }
  for (uint32_t i = 0; i < rays.count; i++) {
    i = found.resolved.FirstOther(i);
    if (i < rays.count) CompleteRay(interval, interval.from + i, rays.hits[i]);
  }
}

/// Collects the outlines of a tile that may stop the fan's rays, sorted by Body::number.
void ExactGroup::Gather(const Fan& fan, grid::OutlineList outlines) {
  bodies_.clear();
  edges_.clear();
  grid_.ForEachOutline(outlines, [&](const grid::OutlineFragment& outline) {
    const grid::Body& body = grid_.body(outline.id);
    if (PassesAboveOrBelow(fan, body)) return;
    if (!fan.predicate(body.model, fan.finder, fan.arg)) return;
    size_t place = bodies_.size();
    while (place > 0 && body.number < bodies_[place - 1]->number) place--;
    const auto at = static_cast<std::ptrdiff_t>(place);
    bodies_.insert(bodies_.begin() + at, &body);
    edges_.insert(edges_.begin() + at, {body.corners, outline.edges});
  });
}

/// Stores the hits of the interval.
void ExactGroup::StoreHits(const RayInterval& interval) {
  const double range = interval.slice.fan->range;
  for (uint32_t i = 0; i < interval.count(); i++) {
    if (!IsWithin(now_[i], range)) continue;
    STAGE_ASSERT(which_[i] < bodies_.size());
    ranges_[interval.from + i] = now_[i];
    hit_bodies_[interval.from + i] = bodies_[which_[i]];
  }
}

/// Completes a ray with this first potential hit, which may meet something nearer in other tiles.
void ExactGroup::CompleteRay(const RayInterval& interval, uint32_t ray, uint32_t hit) {
  const Fan& fan = *interval.slice.fan;
  const FanRecord& record = fan.record;
  STAGE_ASSERT(hit != RAY_NO_HIT && ray >= interval.from && ray < interval.end);
  const Direction& d = interval.directions[ray - interval.first];
  ExactVisit<> visit(grid_, fan, LineOf(fan, interval.slice.unit_vectors[ray - interval.first]));
  visit.SetHit(hit_bodies_[ray], ranges_[ray]);
  LegEnd end{2, 0, 0};
  if (hit_bodies_[ray])
    end = FindLegEnd(record, d, hit, FractionOfLeg(ranges_[ray], fan.leg_length));
  if (end.tiles < 2) {
    counters_->potential_hits++;
    visit.TestTile(grid_.FindTileSlot(end.x, end.y));
  } else {
    ray_t walk;
    BeginRay(*rays_->grid, record, DisplacementOf(record, d), &walk);
    ray_resume(&walk, ray_packed_u(hit), ray_packed_v(hit));
    visit.EndAtNearest(&walk);
    while (ray_next(rays_->grid, rays_->mask, &walk)) {
      counters_->potential_hits++;
      if (visit(&walk, walk.region, walk.tile, walk.bit)) break;
    }
  }
  ranges_[ray] = visit.range();
  hit_bodies_[ray] = visit.hit_body();
}

}  // namespace Stg::internal::sensing
