// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/exact_group.hh"

#include <algorithm>
#include <numeric>

#include "sensing/exact_visit.hh"

namespace Stg::internal::sensing {

void ExactGroup::Trace(const RayGroup& rays, const Part* parts, const FirstHits& first,
                       double* ranges, TraceCounters* counters) {
  ranges_ = ranges;
  counters_ = counters;
  std::fill(met_, met_ + rays.count, nullptr);
  uint32_t numbers[kMost];
  std::iota(numbers, numbers + rays.count, 0);
  Settle(parts, rays.part_count, numbers, first);
  while (rest_->count >= FirstHits::kFewestForLanes && hits_.HasLanes()) NextRound(rays);
  GoOnAlone(rays);
}

/// Asks the outlines in the tiles of the hits. Rays that are not settled then are in *rest_.
void ExactGroup::Settle(const Part* parts, uint32_t part_count, const uint32_t* numbers,
                        const FirstHits& hits) {
  rest_ = rest_ == &rests_[0] ? &rests_[1] : &rests_[0];
  rest_->count = rest_->part_count = 0;
  uint32_t end = 0;
  for (uint32_t i = 0; i < part_count; i++) {
    Run run{parts[i], end, end, end, numbers};
    end += parts[i].count;
    while (run.end < end) {
      run.from = run.end;
      run.end = hits.EndOfRun(run.from);
      const grid::OutlineList outlines = hits.Bodies(run.from);
      if (outlines == FirstHits::kNothing) continue;
      while (run.end < end && HaveSame(outlines, hits.Bodies(run.end)))
        run.end = hits.EndOfRun(run.end);
      SettleRun(run, outlines, hits);
    }
  }
}

/// True if a ray meets the same in both tiles.
bool ExactGroup::HaveSame(grid::OutlineList a, grid::OutlineList b) const {
  if (b == FirstHits::kNothing) return false;
  const grid::OutlinePart &of_a = grid_.outline(a), &of_b = grid_.outline(b);
  return of_a.next == 0 && of_b.next == 0 && of_a.id == of_b.id && of_a.edges == of_b.edges;
}

void ExactGroup::SettleRun(const Run& run, grid::OutlineList outlines, const FirstHits& hits) {
  counters_->potential_hits += run.count();
  const uint32_t in_part = run.from - run.first;
  const OutlineRays rays{run.part.fan, run.part.directions + in_part, run.part.turns + in_part,
                         &hits.Packed(run.from), run.count()};
  Gather(*run.part.fan, outlines);
  OutlineHits found{now_, which_, {}};
  if (!bodies_.empty()) {
    hits.Meet(rays, edges_, &found);
    if (Keep(run)) hits.Settle(rays, now_, &found.settled);
  }
  for (uint32_t i = 0; i < rays.count; i++) {
    i = found.settled.FirstOther(i);
    if (i < rays.count) GoOn(run, run.from + i, rays.hits[i]);
  }
}

/// Gathers the outlines of a tile that the fan's rays may stop at, in the order of their numbers.
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

/// Notes what the rays have met first so far, now or in an earlier tile. True if it was earlier for
/// any of them: now_ has the range of that then.
bool ExactGroup::Keep(const Run& run) {
  const double range = run.part.fan->range;
  bool any_earlier = false;
  for (uint32_t i = 0; i < run.count(); i++) {
    const uint32_t ray = run.numbers[run.from + i];
    const grid::Body& body = *bodies_[which_[i]];
    const grid::Body* const known = met_[ray];
    if (known && !IsNearer(now_[i], body, ranges_[ray], *known)) {
      now_[i] = ranges_[ray];
      any_earlier = true;
    } else if (IsWithin(now_[i], range)) {
      ranges_[ray] = now_[i];
      met_[ray] = &body;
    }
  }
  return any_earlier;
}

/// A ray of the run, which has this hit, goes on: with the rest, if it comes to more than one tile.
void ExactGroup::GoOn(const Run& run, uint32_t ray, uint32_t hit) {
  const Part& part = run.part;
  const uint32_t in_part = ray - run.first, number = run.numbers[ray];
  const double share =
      met_[number] ? ShareOfLeg(ranges_[number], part.fan->leg_length) : 1.0;
  if (met_[number]) {
    const LegEnd end = FindLegEnd(part.fan->record, part.directions[in_part], hit, share);
    if (end.tiles < 2) {
      counters_->potential_hits++;
      ExactVisit<> visit(grid_, *part.fan, LineOf(*part.fan, part.turns[in_part]));
      visit.Know(0, met_[number], ranges_[number]);
      visit.Ask(grid_.FindTileSlot(end.x, end.y));
      ranges_[number] = visit.range();
      met_[number] = visit.met();
      return;
    }
  }
  const uint32_t i = rest_->count++;
  rest_->numbers[i] = number;
  rest_->directions[i] = part.directions[in_part];
  rest_->turns[i] = part.turns[in_part];
  rest_->passed[i] = hit;
  rest_->shares[i] = share;
  if (rest_->part_count == 0 || rest_->parts[rest_->part_count - 1].fan != part.fan)
    rest_->parts[rest_->part_count++] = {part.fan, &rest_->directions[i], &rest_->turns[i], 0};
  rest_->parts[rest_->part_count - 1].count++;
}

/// The rays go on to their next potential hits.
void ExactGroup::NextRound(const RayGroup& all) {
  const Rest& rest = *rest_;
  FanPart parts[kMost];
  for (uint32_t i = 0; i < rest.part_count; i++) {
    const Part& part = rest.parts[i];
    parts[i] = {&part.fan->record, part.directions, part.count, part.fan->leg_length, nullptr};
  }
  hits_.Walk({.grid = all.grid,
              .mask = all.mask,
              .parts = parts,
              .part_count = rest.part_count,
              .count = rest.count,
              .words_of_a_ray = 0,
              .exact = true,
              .passed = rest.passed,
              .shares = rest.shares},
             now_);
  Settle(rest.parts, rest.part_count, rest.numbers, hits_);
}

void ExactGroup::GoOnAlone(const RayGroup& all) {
  uint32_t ray = 0;
  for (uint32_t i = 0; i < rest_->part_count; i++)
    for (uint32_t k = 0; k < rest_->parts[i].count; k++) GoOnAlone(all, rest_->parts[i], ray++);
}

/// Walks a ray of the rest until it has met all that there is.
void ExactGroup::GoOnAlone(const RayGroup& all, const Part& part, uint32_t ray) {
  const Fan& fan = *part.fan;
  const FanRecord& record = fan.record;
  const Direction& d = rest_->directions[ray];
  const uint32_t number = rest_->numbers[ray], passed = rest_->passed[ray];
  ray_t walk;
  ray_begin(&walk, all.grid, record.x, record.y, static_cast<int>(record.fraction & 0xffff),
            static_cast<int>(record.fraction >> 16),
            ray_rotate_x(record.cosine, record.sine, d.cosine, d.sine),
            ray_rotate_y(record.cosine, record.sine, d.cosine, d.sine));
  ray_resume(&walk, ray_packed_u(passed), ray_packed_v(passed));
  ExactVisit<> visit(grid_, fan, LineOf(fan, rest_->turns[ray]));
  visit.Know(grid_.FindTileSlot(walk.x0 + walk.sx * walk.u, walk.y0 + walk.sy * walk.v),
             met_[number], ranges_[number]);
  visit.EndAtNearest(&walk);
  while (ray_next(all.grid, all.mask, &walk)) {
    counters_->potential_hits++;
    if (visit(&walk, walk.region, walk.tile, walk.bit)) break;
  }
  ranges_[number] = visit.range();
  met_[number] = visit.met();
}

}  // namespace Stg::internal::sensing
