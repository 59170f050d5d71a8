// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/exact_group.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "sensing/exact_visit.hh"

namespace Stg::internal::sensing {

void ExactGroup::Trace(const RayGroup& rays, const Part* parts, const FirstHits& first,
                       double* ranges, TraceCounters* counters) {
  rays_ = &rays;
  ranges_ = ranges;
  counters_ = counters;
  std::fill(met_, met_ + rays.count, nullptr);
  STAGE_ASSERT(rays.exact && rays.count <= RayGroup::kMost);
  uint32_t end = 0;
  for (uint32_t i = 0; i < rays.part_count; i++) {
    Run run{parts[i], rays.parts[i].directions, end, end, end};
    end += rays.parts[i].count;
    while (run.end < end) {
      run.from = run.end;
      run.end = first.EndOfRun(run.from);
      const grid::OutlineList outlines = first.Bodies(run.from);
      if (outlines == FirstHits::kNothing) continue;
      while (run.end < end && HaveSame(outlines, first.Bodies(run.end)))
        run.end = first.EndOfRun(run.end);
      Settle(run, outlines, first);
    }
  }
}

/// True if both tiles hold the same edges of the same single outline.
bool ExactGroup::HaveSame(grid::OutlineList a, grid::OutlineList b) const {
  if (b == FirstHits::kNothing) return false;
  const grid::OutlinePart &of_a = grid_.outline(a), &of_b = grid_.outline(b);
  return of_a.next == 0 && of_b.next == 0 && of_a.id == of_b.id && of_a.edges == of_b.edges;
}

void ExactGroup::Settle(const Run& run, grid::OutlineList outlines, const FirstHits& first) {
  STAGE_ASSERT(run.first <= run.from && run.from < run.end && run.end <= rays_->count);
  counters_->potential_hits += run.count();
  const uint32_t in_part = run.from - run.first;
  const OutlineRays rays{run.part.fan, run.directions + in_part, run.part.turns + in_part,
                         &first.Packed(run.from), run.count()};
  Gather(*run.part.fan, outlines);
  OutlineHits found{now_, which_, {}};
  if (!bodies_.empty()) {
    first.Meet(rays, {edges_.data(), static_cast<uint32_t>(edges_.size())}, &found);
    Keep(run);
  }
  for (uint32_t i = 0; i < rays.count; i++) {
    i = found.settled.FirstOther(i);
    if (i < rays.count) GoOn(run, run.from + i, rays.hits[i]);
  }
}

/// Collects the outlines of a tile that may stop the fan's rays, sorted by Body::number.
void ExactGroup::Gather(const Fan& fan, grid::OutlineList outlines) {
  bodies_.clear();
  edges_.clear();
  grid_.ForEachOutline(outlines, [&](const grid::OutlinePart& part) {
    const grid::Body& body = grid_.body(part.id);
    if (PassesAboveOrBelow(fan, body)) return;
    if (!fan.predicate(body.model, fan.finder, fan.arg)) return;
    size_t place = bodies_.size();
    while (place > 0 && body.number < bodies_[place - 1]->number) place--;
    const auto at = static_cast<std::ptrdiff_t>(place);
    bodies_.insert(bodies_.begin() + at, &body);
    edges_.insert(edges_.begin() + at, {body.corners, part.edges});
  });
}

/// Stores the hits of the interval.
void ExactGroup::Keep(const Run& run) {
  const double range = run.part.fan->range;
  for (uint32_t i = 0; i < run.count(); i++) {
    if (!IsWithin(now_[i], range)) continue;
    STAGE_ASSERT(which_[i] < bodies_.size());
    ranges_[run.from + i] = now_[i];
    met_[run.from + i] = bodies_[which_[i]];
  }
}

/// Completes a ray with this first potential hit, which may meet something nearer in other tiles.
void ExactGroup::GoOn(const Run& run, uint32_t ray, uint32_t hit) {
  const Fan& fan = *run.part.fan;
  const FanRecord& record = fan.record;
  STAGE_ASSERT(hit != RAY_NO_HIT && ray >= run.from && ray < run.end);
  const Direction& d = run.directions[ray - run.first];
  ExactVisit<> visit(grid_, fan, LineOf(fan, run.part.turns[ray - run.first]));
  visit.Know(met_[ray], ranges_[ray]);
  LegEnd end{2, 0, 0};
  if (met_[ray]) end = FindLegEnd(record, d, hit, ShareOfLeg(ranges_[ray], fan.leg_length));
  if (end.tiles < 2) {
    counters_->potential_hits++;
    visit.Ask(grid_.FindTileSlot(end.x, end.y));
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
  met_[ray] = visit.met();
}

}  // namespace Stg::internal::sensing
