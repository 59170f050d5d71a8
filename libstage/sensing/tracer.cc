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
void ClipLegs(double start, double step, double low, double high, double* first, double* last) {
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
  ClipLegs(static_cast<double>(x), dx, view.min_x * 65536.0, (view.max_x + 1.0) * 65536.0, &first,
           &last);
  ClipLegs(static_cast<double>(y), dy, view.min_y * 65536.0, (view.max_y + 1.0) * 65536.0, &first,
           &last);
  return {std::max(first, 0.0), last};
}

using Answer = RayRecord::Answer;

/// Records how a ray is traced.
class RecordWriter {
 public:
  RecordWriter(const ray_grid_t& view, const ray_mask_t& mask, RayRecord* record)
      : view_(view), mask_(mask), record_(*record) {}

  void Leg(double number, const ray_t& ray) const {
    record_.legs.push_back({number, {}});
    RecordWalk(view_, mask_, ray, kMaxSteps, &record_.legs.back().steps);
  }
  void Cell(const ray_t& ray) const {
    const double number = record_.legs.back().number;
    const double middle = number + MiddleOf(PassageOf(ray), record_.fan.legs - number);
    record_.potential_hits.push_back(
        {ray.x0 + ray.sx * ray.u, ray.y0 + ray.sy * ray.v, middle * record_.fan.leg_length, {}});
  }
  void Body(const grid::Body& body, Answer answer, double along = 0) const {
    record_.potential_hits.back().tests.push_back(
        {body.model, body.z_min, body.z_max, answer, along});
  }

 private:
  static constexpr size_t kMaxSteps = 65536;  // per leg, which has at most half as many cells
  const ray_grid_t& view_;
  const ray_mask_t& mask_;
  RayRecord& record_;
};

/// The cell ray model: visits the cells along a ray until a predicate accepts a body.
template <class Recorder = NullRecorder>
class CellVisit {
 public:
  CellVisit(const grid::Grid& grid, const Fan& fan, const Recorder& recorder = {})
      : grid_(grid), fan_(fan), recorder_(recorder) {}

  Model* hit() const { return hit_; }

  /// Returns true to end the walk.
  bool operator()(ray_t* ray, uint32_t region, uint32_t tile, uint32_t bit) {
    recorder_.Cell(*ray);
    return grid_.AnyAt(region, tile, bit, [this](grid::BodyId id) { return Accepts(id); });
  }
  bool operator()(grid::BodyList bodies) {
    return grid_.AnyOf(bodies, [this](grid::BodyId id) { return Accepts(id); });
  }

 private:
  bool Accepts(grid::BodyId id) {
    const grid::Body& body = grid_.body(id);
    if (PassesAboveOrBelow(fan_, body)) {
      recorder_.Body(body, Answer::kOtherHeight);
      return false;
    }
    STAGE_ASSERT(fan_.predicate && body.model);
    const bool accepted = fan_.predicate(body.model, fan_.finder, fan_.arg);
    recorder_.Body(body, accepted ? Answer::kAccepted : Answer::kRejected);
    if (accepted) hit_ = body.model;
    return accepted;
  }

  const grid::Grid& grid_;
  const Fan& fan_;
  Model* hit_ = nullptr;
  [[no_unique_address]] const Recorder recorder_;
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

RayHit Tracer::Trace(const Fan& fan, const ray_grid_t& view, const RayDirection& direction,
                     const ray_mask_t& mask, TraceCounters* counters) const {
  counters->rays++;
  if (fan.nothing) return {fan.range, nullptr};
  const Walk walk = WalkOf(fan, view, direction.fixed_point, mask, HitList(), counters);
  return fan.exact ? TraceExact(fan, walk, direction.unit_vector, NullRecorder())
                   : TraceCells(fan, walk, NullRecorder());
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

void Tracer::Record(const Fan& fan, const RayDirection& direction, const ray_mask_t& mask,
                    RayRecord* record) const {
  record->fan = fan;
  record->direction = direction.fixed_point;
  record->unit_vector = direction.unit_vector;
  record->hit = {fan.range, nullptr};
  if (fan.nothing) return;
  const ray_grid_t view = grid_.View(fan.layer);
  TraceCounters counters;
  const Walk walk = WalkOf(fan, view, direction.fixed_point, mask, HitList(), &counters);
  record->dx = walk.dx;
  record->dy = walk.dy;
  record->mask_tiles = mask.width * mask.height;
  record->hidden_cells = CountHidden(mask);
  const RecordWriter recorder(view, mask, record);
  record->hit = fan.exact ? TraceExact(fan, walk, direction.unit_vector, recorder)
                          : TraceCells(fan, walk, recorder);
}

/// Legs join without rounding: each begins where the previous one ended.
template <class Recorder>
RayHit Tracer::TraceCells(const Fan& fan, const Walk& walk, const Recorder& recorder) const {
  const int64_t start_x = StartX(fan), start_y = StartY(fan);
  CellVisit<Recorder> visit(grid_, fan, recorder);
  ray_t ray;
  const LegRange legs = LegsInBox(fan, walk.view, start_x, start_y, walk.dx, walk.dy);
  STAGE_ASSERT(legs.last < fan.legs);
  for (double k = legs.first; k <= legs.last; k += 1.0) {
    const int64_t x = start_x + static_cast<int64_t>(k) * walk.dx;
    const int64_t y = start_y + static_cast<int64_t>(k) * walk.dy;
    Begin(&ray, walk, x, y);
    recorder.Leg(k, ray);
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
template <class Recorder>
RayHit Tracer::TraceExact(const Fan& fan, const Walk& walk, const SineCosine& unit_vector,
                          const Recorder& recorder) const {
  const Line line = LineOf(fan, unit_vector);
  const int64_t start_x = StartX(fan), start_y = StartY(fan);
  const double leg_x = line.direction.cosine * fan.leg_cells * 65536.0;
  const double leg_y = line.direction.sine * fan.leg_cells * 65536.0;
  ExactVisit<Recorder> visit(grid_, fan, line, recorder);
  ray_t ray;
  const LegRange legs = LegsInBox(fan, walk.view, start_x, start_y, walk.dx, walk.dy);
  for (double k = legs.first; k <= legs.last; k += 1.0) {
    if (visit.IsDoneBefore(k * fan.leg_length)) break;
    visit.BeginLeg(k * fan.leg_length);
    Begin(&ray, walk, start_x + static_cast<int64_t>(std::floor(k * leg_x)),
          start_y + static_cast<int64_t>(std::floor(k * leg_y)));
    recorder.Leg(k, ray);
    Follow(walk, &ray, &visit);
  }
  return visit.hit();
}

namespace {

/// Adds a result for the rays `begin` .. `end` - 1 of a fan. A `begin` of 0 starts a new fan.
void AddHits(uint32_t begin, uint32_t end, Model* model, std::vector<HitInterval>* intervals) {
  STAGE_ASSERT(begin < end && (begin == 0 || intervals->back().end == begin));
  if (begin > 0 && intervals->back().model == model)
    intervals->back().end = end;
  else
    intervals->push_back({end, model});
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
        intervals_(hits->intervals),
        counters_(counters),
        first_(tracer.grid_),
        exact_(tracer.grid_) {}

  /// Adds a fan. First traces the group if it is full or incompatible with the fan.
  void Add(const Fan& fan) {
    if (slice_count_ > 0 && !AreCompatible(*fans_[0], fan)) Trace();
    for (uint32_t begin = 0; begin < fan.record.samples;) {
      if (rays_ == RayGroup::kMaxRays) Trace();
      STAGE_ASSERT(fan.single_leg() && rays_ < RayGroup::kMaxRays && slice_count_ <= rays_);
      const uint32_t count = std::min(fan.record.samples - begin, RayGroup::kMaxRays - rays_);
      fans_[slice_count_] = &fan;
      begins_[slice_count_] = begin;
      slices_[slice_count_] = {&fan.record, batch_.DirectionsOf(fan) + begin, count, fan.leg_length,
                               WordsOf(fan, begin)};
      slice_count_++;
      rays_ += count;
      begin += count;
    }
  }
  /// Traces a fan ray by ray.
  void AddSingle(const Fan& fan) {
    Trace();
    tracer_.TraceOneByOne(batch_, fan, ranges_, &intervals_, counters_);
    ranges_ += fan.record.samples;
  }

  /// Traces the collected group.
  void Trace() {
    if (slice_count_ == 0) return;
    view_ = tracer_.grid_.View(fans_[0]->layer);
    mask_ = batch_.SelfMaskOf(*fans_[0]);
    const RayGroup group{.grid = &view_,
                         .mask = &mask_,
                         .slices = slices_,
                         .slice_count = slice_count_,
                         .count = rays_,
                         .words_per_ray = static_cast<uint32_t>(lists_.WordsOf(1)),
                         .exact = fans_[0]->exact};
    if (lists_.per_ray > 0)
      first_.EvaluateDeviceHits(group, ranges_);
    else
      first_.Walk(group, ranges_);
    if (group.exact) TraceExactly(group);
    for (uint32_t slice = 0, ray = 0; slice < slice_count_; ray += slices_[slice++].count) {
      counters_->rays += slices_[slice].count;
      if (group.exact)
        StoreHits(slice, ray);
      else
        Resolve(slice, ray);
    }
    ranges_ += rays_;
    slice_count_ = rays_ = 0;
  }

 private:
  /// True if both walk through the same cells: same layer and self-mask.
  static bool AreCompatible(const Fan& a, const Fan& b) {
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
  void Resolve(uint32_t slice, uint32_t ray) {
    const uint32_t end = ray + slices_[slice].count;
    RayInterval interval{slice, ray, ray, ray};
    while (interval.end < end) {  // neighbouring rays mostly hit the same
      interval.from = interval.end;
      interval.end = first_.EndOfInterval(interval.from);
      STAGE_ASSERT(interval.end > interval.from && interval.end <= end);
      const grid::BodyList bodies = first_.Bodies(interval.from);
      if (bodies == FirstHits::kNothing)
        End(interval, nullptr);
      else
        ResolveCells(interval, bodies);
    }
  }

  /// Traces all slices in the exact model.
  void TraceExactly(const RayGroup& group) {
    for (uint32_t i = 0; i < slice_count_; i++)
      exact_slices_[i] = {fans_[i], batch_.UnitVectorsOf(*fans_[i]) + begins_[i]};
    exact_.Trace(group, exact_slices_, first_, ranges_, counters_);
  }
  /// Stores the results of a slice; `ray` is the index of its first ray in the group.
  void StoreHits(uint32_t slice, uint32_t ray) {
    const uint32_t end = ray + slices_[slice].count;
    for (RayInterval interval{slice, ray, ray, ray}; interval.end < end;
         interval.from = interval.end) {
      Model* const hit = exact_.HitModel(interval.from);
      do interval.end++;
      while (interval.end < end && exact_.HitModel(interval.end) == hit);
      End(interval, hit);
    }
  }

  /// Consecutive rays of a slice.
  struct RayInterval {
    uint32_t slice, first;  // index in the group of the slice's first ray
    uint32_t from, end;     // half-open interval of rays in the group
  };
  /// Index of a ray in its fan.
  uint32_t SampleOf(const RayInterval& interval, uint32_t ray) const {
    STAGE_ASSERT(interval.slice < slice_count_ && ray >= interval.first);
    STAGE_ASSERT(begins_[interval.slice] + ray - interval.first <=
                 fans_[interval.slice]->record.samples);
    return begins_[interval.slice] + ray - interval.first;
  }
  /// Stores the hit of rays whose ranges are known.
  void End(const RayInterval& interval, Model* hit) {
    AddHits(SampleOf(interval, interval.from), SampleOf(interval, interval.end), hit, &intervals_);
  }

  /// Resolves rays whose potential hits lie in cells with these bodies.
  void ResolveCells(const RayInterval& interval, grid::BodyList bodies) {
    counters_->potential_hits += interval.end - interval.from;
    const Fan& fan = *fans_[interval.slice];
    CellVisit<> visit(tracer_.grid_, fan);
    if (visit(bodies)) return End(interval, visit.hit());
    for (uint32_t ray = interval.from; ray < interval.end; ray++)
      EndAt(interval, ray, tracer_.TraceCellsFrom(fan, ResumeWalk(interval, ray)));
  }

  /// Prepares to resume a ray behind its first potential hit.
  Walk ResumeWalk(const RayInterval& interval, uint32_t ray) const {
    HitList list{&first_.Packed(ray), 1, 0};
    if (lists_.per_ray > 0)
      list = {slices_[interval.slice].walked + lists_.WordsOf(ray - interval.first) + 1,
              lists_.per_ray, 1};
    const Fan& fan = *fans_[interval.slice];
    return WalkOf(fan, view_, batch_.DirectionsOf(fan)[SampleOf(interval, ray)], mask_, list,
                  counters_);
  }
  /// Stores the hit of a single ray.
  void EndAt(const RayInterval& interval, uint32_t ray, const RayHit& hit) {
    ranges_[ray] = hit.range;
    const uint32_t sample = SampleOf(interval, ray);
    AddHits(sample, sample + 1, hit.model, &intervals_);
  }

  const Tracer& tracer_;
  const RayBatch& batch_;
  const HitLists& lists_;
  double* ranges_;  // output for the next rays
  std::vector<HitInterval>& intervals_;
  TraceCounters* counters_;
  FirstHits first_;
  ray_grid_t view_;
  ray_mask_t mask_;

  uint32_t slice_count_ = 0, rays_ = 0;
  const Fan* fans_[RayGroup::kMaxRays];
  uint32_t begins_[RayGroup::kMaxRays];  // index in its fan of a slice's first ray
  FanSlice slices_[RayGroup::kMaxRays];
  ExactGroup exact_;
  ExactGroup::SliceData exact_slices_[RayGroup::kMaxRays];
};

/// For fans that no device walks: with several legs, or without rays to cast.
void Tracer::TraceOneByOne(const RayBatch& batch, const Fan& fan, double* ranges,
                           std::vector<HitInterval>* intervals, TraceCounters* counters) const {
  const Direction* directions = batch.DirectionsOf(fan);
  const SineCosine* unit_vectors = batch.UnitVectorsOf(fan);
  const ray_mask_t mask = batch.SelfMaskOf(fan);
  const ray_grid_t view = grid_.View(fan.layer);
  STAGE_ASSERT(!fan.single_leg());
  for (uint32_t i = 0; i < fan.record.samples; i++) {
    const RayHit hit = Trace(fan, view, {directions[i], unit_vectors[i]}, mask, counters);
    ranges[i] = hit.range;
    AddHits(i, i + 1, hit.model, intervals);
  }
}

void Tracer::TraceFans(const RayBatch& batch, std::span<const Fan> fans, const HitLists& lists,
                       Hits* hits, TraceCounters* counters) const {
  size_t rays = 0;
  for (const Fan& fan : fans) rays += fan.record.samples;
  if (hits->ranges.size() <= rays) hits->ranges.resize(rays + 1);
  hits->intervals.clear();
  Group group(*this, batch, lists, hits, counters);
  for (const Fan& fan : fans) {
    if (fan.single_leg())
      group.Add(fan);
    else
      group.AddSingle(fan);
  }
  group.Trace();
  STAGE_ASSERT(hits->intervals.empty() == (rays == 0));
}

}  // namespace Stg::internal::sensing
