// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/tracer.hh"

#include <algorithm>
#include <bit>
#include <cmath>

#include "messages/assert.hh"
#include "sensing/exact_group.hh"
#include "sensing/exact_visit.hh"
#include "sensing/first_hits.hh"
#include "sensing/middle.hh"

namespace Stg::internal::sensing {

namespace {

/// Narrows *first .. *last to the legs that may touch the occupied box on one axis: those for which
/// [start + k * step, start + (k + 1) * step] meets [low, high]. All in Q16.
void CutLegs(double start, double step, double low, double high, double* first, double* last) {
  if (step == 0) {
    if (start < low || start > high) *last = -1;
    return;
  }
  if (step < 0) {
    start = -start;
    step = -step;
    std::swap(low, high);
    low = -low;
    high = -high;
  }
  *first = std::max(*first, std::floor((low - start) / step) - 1);
  *last = std::min(*last, std::ceil((high - start) / step));
}

/// Interval of legs to walk, ends included.
struct LegRange {
  double first, last;
};

/// Legs that may touch the occupied box. (x, y) is the start, (dx, dy) one leg, in Q16.
LegRange LegsInBox(const Fan& fan, const ray_grid_t& view, int64_t x, int64_t y, int32_t dx,
                   int32_t dy) {
  if (fan.legs == 1) return {0, 0};
  double first = 0, last = fan.legs - 1;
  CutLegs(static_cast<double>(x), dx, view.min_x * 65536.0, (view.max_x + 1.0) * 65536.0, &first,
          &last);
  CutLegs(static_cast<double>(y), dy, view.min_y * 65536.0, (view.max_y + 1.0) * 65536.0, &first,
          &last);
  return {std::max(first, 0.0), last};
}

using Answer = RayRecord::Answer;

/// Records how a ray is traced.
class Notes {
 public:
  Notes(const ray_grid_t& view, const ray_mask_t& mask, RayRecord* record)
      : view_(view), mask_(mask), record_(*record) {}

  void Leg(double number, const ray_t& ray) const {
    record_.legs.push_back({number, {}});
    RecordWalk(view_, mask_, ray, kMostSteps, &record_.legs.back().steps);
  }
  void Cell(const ray_t& ray) const {
    const double number = record_.legs.back().number;
    const double middle = number + MiddleOf(PassageOf(ray), record_.fan.legs - number);
    record_.potential_hits.push_back(
        {ray.x0 + ray.sx * ray.u, ray.y0 + ray.sy * ray.v, middle * record_.fan.leg_length, {}});
  }
  void Body(const grid::Body& body, Answer answer, double along = 0) const {
    record_.potential_hits.back().questions.push_back(
        {body.model, body.z_min, body.z_max, answer, along});
  }

 private:
  static constexpr size_t kMostSteps = 65536;  // per leg, which has at most half as many cells
  const ray_grid_t& view_;
  const ray_mask_t& mask_;
  RayRecord& record_;
};

/// The cell ray model: visits the cells along a ray until a predicate accepts a body.
template <class Taking = NoNotes>
class CellVisit {
 public:
  CellVisit(const grid::Grid& grid, const Fan& fan, const Taking& notes = {})
      : grid_(grid), fan_(fan), notes_(notes) {}

  Model* hit() const { return hit_; }

  /// Returns true to end the walk.
  bool operator()(ray_t* ray, uint32_t region, uint32_t tile, uint32_t bit) {
    notes_.Cell(*ray);
    return grid_.AnyAt(region, tile, bit, [this](grid::BodyId id) { return Accepts(id); });
  }
  bool operator()(grid::BodyList bodies) {
    return grid_.AnyOf(bodies, [this](grid::BodyId id) { return Accepts(id); });
  }

 private:
  bool Accepts(grid::BodyId id) {
    const grid::Body& body = grid_.body(id);
    if (PassesAboveOrBelow(fan_, body)) {
      notes_.Body(body, Answer::kOtherHeight);
      return false;
    }
    STAGE_ASSERT(fan_.predicate && body.model);
    const bool accepted = fan_.predicate(body.model, fan_.finder, fan_.arg);
    notes_.Body(body, accepted ? Answer::kAccepted : Answer::kRefused);
    if (accepted) hit_ = body.model;
    return accepted;
  }

  const grid::Grid& grid_;
  const Fan& fan_;
  Model* hit_ = nullptr;
  [[no_unique_address]] const Taking notes_;
};

}  // namespace

/// The constant inputs of a ray's walk.
struct Tracer::Walk {
  const ray_grid_t& view;
  const ray_mask_t& mask;
  HitList list;
  int32_t dx, dy;  // displacement of a leg, Q16 cells
  TraceCounters* counters;
};

namespace {

/// Start of the fan in Q16 cells.
int64_t StartX(const Fan& fan) {
  return int64_t{fan.record.x} * 65536 + (fan.record.fraction & 0xffff);
}
int64_t StartY(const Fan& fan) {
  return int64_t{fan.record.y} * 65536 + (fan.record.fraction >> 16);
}

}  // namespace

/// Begins a leg at (x, y), in Q16 cells.
void Tracer::Begin(ray_t* ray, const Walk& walk, int64_t x, int64_t y) {
  ray_begin(ray, &walk.view, static_cast<int32_t>(x >> 16), static_cast<int32_t>(y >> 16),
            static_cast<int>(x & 0xffff), static_cast<int>(y & 0xffff), walk.dx, walk.dy);
}

/// Resumes a ray of one leg in the first cell of its list.
void Tracer::BeginAtFirst(ray_t* ray, const Fan& fan, const Walk& walk) {
  STAGE_ASSERT(walk.list.count > 0 && *walk.list.hits != RAY_NO_HIT && fan.single_leg());
  Begin(ray, walk, StartX(fan), StartY(fan));
  ray_resume(ray, ray_packed_u(*walk.list.hits), ray_packed_v(*walk.list.hits));
}

/// Calls `visit` for the occupied cells along the ray until it returns true: the cells of the list
/// except the first, which was visited before, then those that the walk finds.
template <typename Visit>
void Tracer::Follow(const Walk& walk, ray_t* ray, Visit* visit) const {
  for (uint32_t i = 1; i < walk.list.count; i++) {
    const uint32_t hit = walk.list.hits[i];
    if (hit == RAY_NO_HIT) return;  // the ray ended
    ray_resume(ray, ray_packed_u(hit), ray_packed_v(hit));
    const int32_t x = ray->x0 + ray->sx * ray->u, y = ray->y0 + ray->sy * ray->v;
    walk.counters->potential_hits++;
    const uint32_t region = grid_.FindRegion(x, y);
    if ((*visit)(ray, region, grid::Grid::TileOf(x, y), grid::Grid::BitOf(x, y))) return;
  }
  walk.counters->resumed += walk.list.of_device;
  while (ray_next(&walk.view, &walk.mask, ray)) {
    walk.counters->potential_hits++;
    if ((*visit)(ray, ray->region, ray->tile, ray->bit)) return;
  }
}

RayHit Tracer::Trace(const Fan& fan, const ray_grid_t& view, const Bearing& bearing,
                     const ray_mask_t& mask, TraceCounters* counters) const {
  counters->rays++;
  if (fan.nothing) return {fan.range, nullptr};
  const Walk walk = WalkOf(fan, view, bearing.direction, mask, HitList(), counters);
  return fan.exact ? TraceExact(fan, walk, bearing.turn, NoNotes())
                   : TraceCells(fan, walk, NoNotes());
}

Tracer::Walk Tracer::WalkOf(const Fan& fan, const ray_grid_t& view, const Direction& direction,
                            const ray_mask_t& mask, const HitList& list, TraceCounters* counters) {
  const auto [dx, dy] = DisplacementOf(fan.record, direction);
  return {view, mask, list, dx, dy, counters};
}

namespace {

uint32_t CountHidden(const ray_mask_t& mask) {
  uint32_t cells = 0;
  for (uint32_t i = 0; i < mask.width * mask.height; i++)
    cells += static_cast<uint32_t>(std::popcount(mask.tiles[i]));
  return cells;
}

}  // namespace

void Tracer::Record(const Fan& fan, const Bearing& bearing, const ray_mask_t& mask,
                    RayRecord* record) const {
  record->fan = fan;
  record->direction = bearing.direction;
  record->turn = bearing.turn;
  record->hit = {fan.range, nullptr};
  if (fan.nothing) return;
  const ray_grid_t view = grid_.View(fan.layer);
  TraceCounters counters;
  const Walk walk = WalkOf(fan, view, bearing.direction, mask, HitList(), &counters);
  record->dx = walk.dx;
  record->dy = walk.dy;
  record->mask_tiles = mask.width * mask.height;
  record->hidden_cells = CountHidden(mask);
  const Notes notes(view, mask, record);
  record->hit =
      fan.exact ? TraceExact(fan, walk, bearing.turn, notes) : TraceCells(fan, walk, notes);
}

/// Legs join without rounding: each begins where the previous one ended.
template <class Taking>
RayHit Tracer::TraceCells(const Fan& fan, const Walk& walk, const Taking& notes) const {
  const int64_t start_x = StartX(fan), start_y = StartY(fan);
  CellVisit<Taking> visit(grid_, fan, notes);
  ray_t ray;
  const LegRange legs = LegsInBox(fan, walk.view, start_x, start_y, walk.dx, walk.dy);
  STAGE_ASSERT(legs.last < fan.legs);
  for (double k = legs.first; k <= legs.last; k += 1.0) {
    const int64_t x = start_x + static_cast<int64_t>(k) * walk.dx;
    const int64_t y = start_y + static_cast<int64_t>(k) * walk.dy;
    Begin(&ray, walk, x, y);
    notes.Leg(k, ray);
    Follow(walk, &ray, &visit);
    if (visit.hit())
      return {(k + MiddleOf(PassageOf(ray), fan.legs - k)) * fan.leg_length, visit.hit()};
  }
  return {fan.range, nullptr};
}

/// Traces a ray of one leg whose first listed cell is known not to stop it.
RayHit Tracer::TraceCellsFrom(const Fan& fan, const Walk& walk) const {
  CellVisit<> visit(grid_, fan);
  ray_t ray;
  BeginAtFirst(&ray, fan, walk);
  Follow(walk, &ray, &visit);
  if (!visit.hit()) return {fan.range, nullptr};
  return {MiddleOf(PassageOf(ray), fan.legs) * fan.leg_length, visit.hit()};
}

/// Each leg starts on the true ray, so that the walk stays within the grid's margin for outlines
/// however far it gets.
template <class Taking>
RayHit Tracer::TraceExact(const Fan& fan, const Walk& walk, const SineCosine& turn,
                          const Taking& notes) const {
  const Line line = LineOf(fan, turn);
  const int64_t start_x = StartX(fan), start_y = StartY(fan);
  const double leg_x = line.direction.cosine * fan.leg_cells * 65536.0;
  const double leg_y = line.direction.sine * fan.leg_cells * 65536.0;
  ExactVisit<Taking> visit(grid_, fan, line, notes);
  ray_t ray;
  const LegRange legs = LegsInBox(fan, walk.view, start_x, start_y, walk.dx, walk.dy);
  for (double k = legs.first; k <= legs.last; k += 1.0) {
    if (visit.IsDoneBefore(k * fan.leg_length)) break;
    visit.BeginLeg(k * fan.leg_length);
    Begin(&ray, walk, start_x + static_cast<int64_t>(std::floor(k * leg_x)),
          start_y + static_cast<int64_t>(std::floor(k * leg_y)));
    notes.Leg(k, ray);
    Follow(walk, &ray, &visit);
  }
  return visit.hit();
}

namespace {

/// Adds a result for the rays `begin` .. `end` - 1 of a fan. A `begin` of 0 starts a new fan.
void AddRun(uint32_t begin, uint32_t end, Model* model, std::vector<HitRun>* runs) {
  STAGE_ASSERT(begin < end && (begin == 0 || runs->back().end == begin));
  if (begin > 0 && runs->back().model == model)
    runs->back().end = end;
  else
    runs->push_back({end, model});
}

}  // namespace

/// Collects the rays of fans and traces them in groups.
class Tracer::Group {
 public:
  Group(const Tracer& tracer, const RayBatch& batch, const HitLists& lists, Hits* hits,
        TraceCounters* counters)
      : tracer_(tracer),
        batch_(batch),
        lists_(lists),
        ranges_(hits->ranges.data()),
        runs_(hits->runs),
        counters_(counters),
        first_(tracer.grid_),
        exact_(tracer.grid_) {}

  /// Adds a fan. First traces the group if it is full or incompatible with the fan.
  void Add(const Fan& fan) {
    if (part_count_ > 0 && !GoTogether(*fans_[0], fan)) Trace();
    for (uint32_t begin = 0; begin < fan.record.samples;) {
      if (rays_ == RayGroup::kMost) Trace();
      STAGE_ASSERT(fan.single_leg() && rays_ < RayGroup::kMost && part_count_ <= rays_);
      const uint32_t count = std::min(fan.record.samples - begin, RayGroup::kMost - rays_);
      fans_[part_count_] = &fan;
      begins_[part_count_] = begin;
      parts_[part_count_] = {&fan.record, batch_.DirectionsOf(fan) + begin, count, fan.leg_length,
                             WordsOf(fan, begin)};
      part_count_++;
      rays_ += count;
      begin += count;
    }
  }
  /// Traces a fan ray by ray.
  void AddAlone(const Fan& fan) {
    Trace();
    tracer_.TraceOneByOne(batch_, fan, ranges_, &runs_, counters_);
    ranges_ += fan.record.samples;
  }

  /// Traces the collected group.
  void Trace() {
    if (part_count_ == 0) return;
    view_ = tracer_.grid_.View(fans_[0]->layer);
    mask_ = batch_.SelfMaskOf(*fans_[0]);
    const RayGroup group{.grid = &view_,
                         .mask = &mask_,
                         .parts = parts_,
                         .part_count = part_count_,
                         .count = rays_,
                         .words_of_a_ray = static_cast<uint32_t>(lists_.WordsOf(1)),
                         .exact = fans_[0]->exact};
    if (lists_.per_ray > 0)
      first_.Look(group, ranges_);
    else
      first_.Walk(group, ranges_);
    if (group.exact) TraceExactly(group);
    for (uint32_t part = 0, ray = 0; part < part_count_; ray += parts_[part++].count) {
      counters_->rays += parts_[part].count;
      if (group.exact)
        WriteRuns(part, ray);
      else
        Settle(part, ray);
    }
    ranges_ += rays_;
    part_count_ = rays_ = 0;
  }

 private:
  /// True if both walk through the same cells: same layer and self-mask.
  static bool GoTogether(const Fan& a, const Fan& b) {
    return a.layer == b.layer && a.record.mask_size == b.record.mask_size &&
           (a.record.mask_size == 0 || a.record.mask_first == b.record.mask_first);
  }

  /// The device's results for the fan's rays from `ray` on.
  const uint32_t* WordsOf(const Fan& fan, uint32_t ray) const {
    if (lists_.per_ray == 0) return nullptr;
    return lists_.words + lists_.WordsOf(size_t{fan.record.first_ray} + ray);
  }

  /// Resolves the hits of one slice; `ray` is the index of its first ray in the group. Rays without
  /// a hit keep the fan's range, which is the length of the only leg.
  void Settle(uint32_t part, uint32_t ray) {
    const uint32_t end = ray + parts_[part].count;
    Run run{part, ray, ray, ray};
    while (run.end < end) {  // neighbouring rays mostly hit the same
      run.from = run.end;
      run.end = first_.EndOfRun(run.from);
      STAGE_ASSERT(run.end > run.from && run.end <= end);
      const grid::BodyList bodies = first_.Bodies(run.from);
      if (bodies == FirstHits::kNothing)
        End(run, nullptr);
      else
        SettleCells(run, bodies);
    }
  }

  /// Traces all slices in the exact model.
  void TraceExactly(const RayGroup& group) {
    for (uint32_t i = 0; i < part_count_; i++)
      exact_parts_[i] = {fans_[i], batch_.TurnsOf(*fans_[i]) + begins_[i]};
    exact_.Trace(group, exact_parts_, first_, ranges_, counters_);
  }
  /// Stores the results of a slice; `ray` is the index of its first ray in the group.
  void WriteRuns(uint32_t part, uint32_t ray) {
    const uint32_t end = ray + parts_[part].count;
    for (Run run{part, ray, ray, ray}; run.end < end; run.from = run.end) {
      Model* const met = exact_.Met(run.from);
      do run.end++;
      while (run.end < end && exact_.Met(run.end) == met);
      End(run, met);
    }
  }

  /// Consecutive rays of a slice.
  struct Run {
    uint32_t part, first;  // index in the group of the slice's first ray
    uint32_t from, end;    // half-open interval of rays in the group
  };
  /// Index of a ray in its fan.
  uint32_t SampleOf(const Run& run, uint32_t ray) const {
    STAGE_ASSERT(run.part < part_count_ && ray >= run.first);
    STAGE_ASSERT(begins_[run.part] + ray - run.first <= fans_[run.part]->record.samples);
    return begins_[run.part] + ray - run.first;
  }
  /// Stores the hit of rays whose ranges are known.
  void End(const Run& run, Model* hit) {
    AddRun(SampleOf(run, run.from), SampleOf(run, run.end), hit, &runs_);
  }

  /// Resolves rays whose potential hits lie in cells with these bodies.
  void SettleCells(const Run& run, grid::BodyList bodies) {
    counters_->potential_hits += run.end - run.from;
    const Fan& fan = *fans_[run.part];
    CellVisit<> visit(tracer_.grid_, fan);
    if (visit(bodies)) return End(run, visit.hit());
    for (uint32_t ray = run.from; ray < run.end; ray++)
      EndAt(run, ray, tracer_.TraceCellsFrom(fan, WalkOn(run, ray)));
  }

  /// Prepares to resume a ray behind its first potential hit.
  Walk WalkOn(const Run& run, uint32_t ray) const {
    HitList list{&first_.Packed(ray), 1, 0};
    if (lists_.per_ray > 0)
      list = {parts_[run.part].walked + lists_.WordsOf(ray - run.first) + 1, lists_.per_ray, 1};
    const Fan& fan = *fans_[run.part];
    return WalkOf(fan, view_, batch_.DirectionsOf(fan)[SampleOf(run, ray)], mask_, list, counters_);
  }
  /// Stores the hit of a single ray.
  void EndAt(const Run& run, uint32_t ray, const RayHit& hit) {
    ranges_[ray] = hit.range;
    const uint32_t sample = SampleOf(run, ray);
    AddRun(sample, sample + 1, hit.model, &runs_);
  }

  const Tracer& tracer_;
  const RayBatch& batch_;
  const HitLists& lists_;
  double* ranges_;  // output for the next rays
  std::vector<HitRun>& runs_;
  TraceCounters* counters_;
  FirstHits first_;
  ray_grid_t view_;
  ray_mask_t mask_;

  uint32_t part_count_ = 0, rays_ = 0;
  const Fan* fans_[RayGroup::kMost];
  uint32_t begins_[RayGroup::kMost];  // index in its fan of a slice's first ray
  FanPart parts_[RayGroup::kMost];
  ExactGroup exact_;
  ExactGroup::Part exact_parts_[RayGroup::kMost];
};

/// For fans that no device walks: with several legs, or without rays to cast.
void Tracer::TraceOneByOne(const RayBatch& batch, const Fan& fan, double* ranges,
                           std::vector<HitRun>* runs, TraceCounters* counters) const {
  const Direction* directions = batch.DirectionsOf(fan);
  const SineCosine* turns = batch.TurnsOf(fan);
  const ray_mask_t mask = batch.SelfMaskOf(fan);
  const ray_grid_t view = grid_.View(fan.layer);
  STAGE_ASSERT(!fan.single_leg());
  for (uint32_t i = 0; i < fan.record.samples; i++) {
    const RayHit hit = Trace(fan, view, {directions[i], turns[i]}, mask, counters);
    ranges[i] = hit.range;
    AddRun(i, i + 1, hit.model, runs);
  }
}

void Tracer::TraceFans(const RayBatch& batch, std::span<const Fan> fans, const HitLists& lists,
                       Hits* hits, TraceCounters* counters) const {
  size_t rays = 0;
  for (const Fan& fan : fans) rays += fan.record.samples;
  if (hits->ranges.size() <= rays) hits->ranges.resize(rays + 1);
  hits->runs.clear();
  Group group(*this, batch, lists, hits, counters);
  for (const Fan& fan : fans) {
    if (fan.single_leg())
      group.Add(fan);
    else
      group.AddAlone(fan);
  }
  group.Trace();
  STAGE_ASSERT(hits->runs.empty() == (rays == 0));
}

}  // namespace Stg::internal::sensing
