// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/tracer.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "sensing/crossing.hh"
#include "sensing/first_hits.hh"
#include "sensing/middle.hh"

namespace Stg::internal::sensing {

namespace {

/// First and last leg, of `legs`, that may touch the occupied box on one axis: those for which
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

/// Numbers of the legs to walk, ends included.
struct LegRange {
  double first, last;
};

/// The legs that may touch the occupied box. `x`, `y`: the start, `dx`, `dy`: a leg, all in Q16.
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

bool PassesAboveOrBelow(const Fan& fan, const grid::Body& body) {
  return fan.z_test && (fan.z < body.z_min || fan.z > body.z_max);
}

/// Of bodies that a ray meets at the same place, it stops at that with the smallest number, in
/// whatever order it gets to know them.
bool IsNearer(double along, const grid::Body& body, double nearest, const grid::Body& other) {
  return along < nearest || (along == nearest && body.number < other.number);
}

/// The range itself still counts.
bool IsWithin(double along, double range) { return along <= range && std::isfinite(along); }

/// Takes no notes of how a ray is traced: nothing is left of it in the code.
struct NoNotes {
  void Leg(double, const ray_t&) const {}
  void Cell(const ray_t&) const {}
  void Body(const grid::Body&, Answer, double = 0) const {}
};

/// Writes it down.
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
  static constexpr size_t kMostSteps = 65536;  // of a leg, which has at most half as many cells
  const ray_grid_t& view_;
  const ray_mask_t& mask_;
  RayRecord& record_;
};

/// Visits the cells that a ray reaches until a body's predicate accepts it: the cell model.
template <class Taking = NoNotes>
class CellVisit {
 public:
  CellVisit(const grid::Grid& grid, const Fan& fan, const Taking& notes = {})
      : grid_(grid), fan_(fan), notes_(notes) {}

  Model* hit() const { return hit_; }

  /// True ends the walk.
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
    if (body.exact()) return false;
    if (PassesAboveOrBelow(fan_, body)) {
      notes_.Body(body, Answer::kOtherHeight);
      return false;
    }
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

/// Visits the cells that a ray reaches and intersects it with the outlines in their tiles, until no
/// cell to come can hold a nearer crossing: the exact model.
template <class Taking>
class ExactVisit {
 public:
  ExactVisit(const grid::Grid& grid, const Fan& fan, const Line& line, const Taking& notes = {})
      : grid_(grid), fan_(fan), line_(line), nearest_(fan.range), notes_(notes) {}

  RayHit hit() const { return {nearest_, hit_ ? hit_->model : nullptr}; }
  /// Whether the leg that begins so many metres from the start can change nothing any more.
  bool IsDoneBefore(double leg_start) const { return hit_ && nearest_ <= leg_start; }
  void BeginLeg(double leg_start) { leg_start_ = leg_start; }

  bool operator()(ray_t* ray, uint32_t region, uint32_t tile, uint32_t) {
    if (PastLimits(*ray, ray->u, ray->v)) return true;  // a listed cell behind a hit
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
  /// Of the outlines in a tile is known that the ray meets none of them, or this one first.
  void Know(uint32_t slot, const grid::Body* met, double along) {
    asked_ = slot;
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
    if (PassesAboveOrBelow(fan_, body)) return Decline(body, Answer::kOtherHeight);
    if (PassesBy(line_, point_t(body.x, body.y), body.radius, nearest_))
      return Decline(body, Answer::kMissed);
    const double along = FirstCrossing(line_, body.corners, part.edges);
    if (!IsNearer(body, along)) return Decline(body, Answer::kMissed);
    if (!fan_.predicate(body.model, fan_.finder, fan_.arg))
      return Decline(body, Answer::kRefused, along);
    notes_.Body(body, Answer::kAccepted, along);
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
  bool Decline(const grid::Body& body, Answer answer, double along = 0) const {
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

}  // namespace

/// How a ray is walked.
struct Tracer::Walk {
  const ray_grid_t& view;
  const ray_mask_t& mask;
  HitList list;
  int32_t dx, dy;  // displacement of a leg, Q16 cells
  TraceCounters* counters;
};

namespace {

/// The start, Q16 cells.
int64_t StartX(const Fan& fan) {
  return int64_t{fan.record.x} * 65536 + (fan.record.fraction & 0xffff);
}
int64_t StartY(const Fan& fan) {
  return int64_t{fan.record.y} * 65536 + (fan.record.fraction >> 16);
}

}  // namespace

/// Begins a leg at (x, y), Q16.
void Tracer::Begin(ray_t* ray, const Walk& walk, int64_t x, int64_t y) {
  ray_begin(ray, &walk.view, static_cast<int32_t>(x >> 16), static_cast<int32_t>(y >> 16),
            static_cast<int>(x & 0xffff), static_cast<int>(y & 0xffff), walk.dx, walk.dy);
}

/// A ray of one leg, in the first cell of the list.
void Tracer::BeginAtFirst(ray_t* ray, const Fan& fan, const Walk& walk) {
  Begin(ray, walk, StartX(fan), StartY(fan));
  ray_resume(ray, ray_packed_u(*walk.list.hits), ray_packed_v(*walk.list.hits));
}

/// Takes `visit` to the cell that the ray is in. True if it ends there.
template <typename Visit>
bool Tracer::VisitCell(ray_t* ray, Visit* visit) const {
  const int32_t x = ray->x0 + ray->sx * ray->u, y = ray->y0 + ray->sy * ray->v;
  const uint32_t region = grid_.FindRegion(x, y);
  return (*visit)(ray, region, grid::Grid::TileOf(x, y), grid::Grid::BitOf(x, y));
}

/// Takes `visit` to the cells in which something is, in their order along the ray: those of the
/// list but the first, where it has been, then those that the walk finds behind them.
template <typename Visit>
void Tracer::Follow(const Walk& walk, ray_t* ray, Visit* visit) const {
  for (uint32_t i = 1; i < walk.list.count; i++) {
    const uint32_t hit = walk.list.hits[i];
    if (hit == RAY_NO_HIT) return;  // the ray ended; there is nothing behind
    ray_resume(ray, ray_packed_u(hit), ray_packed_v(hit));
    walk.counters->potential_hits++;
    if (VisitCell(ray, visit)) return;
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
  const FanRecord& record = fan.record;
  return {view,
          mask,
          list,
          ray_rotate_x(record.cosine, record.sine, direction.cosine, direction.sine),
          ray_rotate_y(record.cosine, record.sine, direction.cosine, direction.sine),
          counters};
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

/// Legs join without rounding: each begins where the one before has ended.
template <class Taking>
RayHit Tracer::TraceCells(const Fan& fan, const Walk& walk, const Taking& notes) const {
  const int64_t start_x = StartX(fan), start_y = StartY(fan);
  CellVisit<Taking> visit(grid_, fan, notes);
  ray_t ray;
  const LegRange legs = LegsInBox(fan, walk.view, start_x, start_y, walk.dx, walk.dy);
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

/// A ray of one leg, of which the first cell of the list is known not to end it.
RayHit Tracer::TraceCellsFrom(const Fan& fan, const Walk& walk) const {
  CellVisit<> visit(grid_, fan);
  ray_t ray;
  BeginAtFirst(&ray, fan, walk);
  Follow(walk, &ray, &visit);
  if (!visit.hit()) return {fan.range, nullptr};
  return {MiddleOf(PassageOf(ray), fan.legs) * fan.leg_length, visit.hit()};
}

/// Each leg begins on the true ray, so that the walk stays as near to it as the outlines' margin in
/// the grid allows for, however far out it gets.
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

/// A ray of one leg, of which is known what it meets in the tile of the first cell of the list.
RayHit Tracer::TraceExactFrom(const Fan& fan, const Walk& walk, const SineCosine& turn,
                              const grid::Body* met, double range) const {
  ExactVisit<NoNotes> visit(grid_, fan, LineOf(fan, turn));
  ray_t ray;
  BeginAtFirst(&ray, fan, walk);
  const uint32_t slot = grid_.FindTileSlot(ray.x0 + ray.sx * ray.u, ray.y0 + ray.sy * ray.v);
  visit.Know(slot, met, range);
  visit.EndAtNearest(&ray);
  const uint32_t next = met ? OnlyTileBehind(ray) : kNoTile;
  if (next != kNoTile)
    visit.Ask(next);
  else
    Follow(walk, &ray, &visit);
  return visit.hit();
}

/// The slot of the tile in which the ray ends, if it is next to the one where it is: mostly it is,
/// for rays that have come to a wall and are known to meet it. Else kNoTile.
uint32_t Tracer::OnlyTileBehind(const ray_t& ray) const {
  constexpr int kSide = 1 << RAY_TILE_SHIFT;
  const int32_t x = ray.x0 + ray.sx * ray.u, y = ray.y0 + ray.sy * ray.v;
  const auto next_tile = [](int borders, int32_t cell, int step) {
    return borders + kSide - ((step < 0 ? ~cell : cell) & (kSide - 1));
  };
  const int u = next_tile(ray.u, x, ray.sx), v = next_tile(ray.v, y, ray.sy);
  const bool ends_x = (u << 16) - ray.ox > ray.limit_x, ends_y = (v << 16) - ray.oy > ray.limit_y;
  if (ends_x == ends_y) return kNoTile;
  const bool ends_next = ends_y ? ((u + kSide) << 16) - ray.ox > ray.limit_x
                                : ((v + kSide) << 16) - ray.oy > ray.limit_y;
  if (!ends_next) return kNoTile;
  return ends_y ? grid_.FindTileSlot(ray.x0 + ray.sx * u, y)
                : grid_.FindTileSlot(x, ray.y0 + ray.sy * v);
}

namespace {

/// Rays `begin` to `end` - 1 of a fan have hit the model. If begin is 0, the fan begins.
void AddRun(uint32_t begin, uint32_t end, Model* model, std::vector<HitRun>* runs) {
  if (begin > 0 && runs->back().model == model)
    runs->back().end = end;
  else
    runs->push_back({end, model});
}

}  // namespace

/// Rays that are walked together, as they come.
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
        first_(tracer.grid_) {}

  /// Adds a fan. Those before it are traced if there is no room left, or if it does not go with
  /// them.
  void Add(const Fan& fan) {
    if (part_count_ > 0 && !GoTogether(*fans_[0], fan)) Trace();
    for (uint32_t begin = 0; begin < fan.record.samples;) {
      if (rays_ == RayGroup::kMost) Trace();
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
  /// A fan whose rays are traced on their own.
  void AddAlone(const Fan& fan) {
    Trace();
    tracer_.TraceOneByOne(batch_, fan, ranges_, &runs_, counters_);
    ranges_ += fan.record.samples;
  }

  /// Traces what has been added.
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
    for (uint32_t part = 0, ray = 0; part < part_count_; ray += parts_[part++].count)
      Settle(part, ray);
    ranges_ += rays_;
    part_count_ = rays_ = 0;
  }

 private:
  /// The walk of both is through the same cells.
  static bool GoTogether(const Fan& a, const Fan& b) {
    return a.layer == b.layer && a.record.mask_size == b.record.mask_size &&
           (a.record.mask_size == 0 || a.record.mask_first == b.record.mask_first);
  }

  /// What the device says of the fan's rays from this one on.
  const uint32_t* WordsOf(const Fan& fan, uint32_t ray) const {
    if (lists_.per_ray == 0) return nullptr;
    return lists_.words + lists_.WordsOf(size_t{fan.record.first_ray} + ray);
  }

  /// Finds out what the rays of a part hit, the first of which is `ray` of the group. Where there
  /// is nothing, they have the fan's range already: it is the length of the only leg.
  void Settle(uint32_t part, uint32_t ray) {
    counters_->rays += parts_[part].count;
    const uint32_t end = ray + parts_[part].count;
    Run run{part, ray, ray, ray};
    while (run.end < end) {  // neighbouring rays mostly hit the same
      run.from = run.end;
      run.end = first_.EndOfRun(run.from);
      const grid::BodyList bodies = first_.Bodies(run.from);
      if (bodies == FirstHits::kNothing) {
        End(run, nullptr);
        continue;
      }
      if (fans_[part]->exact)
        SettleExact(&run, end, bodies);
      else
        SettleCells(run, bodies);
    }
  }

  /// Neighbouring rays of a part.
  struct Run {
    uint32_t part, first;  // the first ray of that
    uint32_t from, end;    // the rays, in the group

    Run Some(uint32_t some_from, uint32_t some_end) const {
      return {part, first, some_from, some_end};
    }
  };
  /// Of a ray, in its fan.
  uint32_t SampleOf(const Run& run, uint32_t ray) const {
    return begins_[run.part] + ray - run.first;
  }
  /// The rays have hit the model, and their ranges are known.
  void End(const Run& run, Model* hit) {
    AddRun(SampleOf(run, run.from), SampleOf(run, run.end), hit, &runs_);
  }

  /// Of rays with potential hits in cells that have these bodies.
  void SettleCells(const Run& run, grid::BodyList bodies) {
    counters_->potential_hits += run.end - run.from;
    const Fan& fan = *fans_[run.part];
    CellVisit<> visit(tracer_.grid_, fan);
    if (visit(bodies)) return End(run, visit.hit());
    for (uint32_t ray = run.from; ray < run.end; ray++)
      EndAt(run, ray, tracer_.TraceCellsFrom(fan, WalkOn(run, ray)));
  }

  /// Of rays with potential hits in tiles that have these outlines. The run gets longer, up to
  /// `end`, if the next tiles have the same.
  void SettleExact(Run* run, uint32_t end, grid::OutlineList outlines) {
    while (run->end < end && HaveSameOutlines(outlines, first_.Bodies(run->end)))
      run->end = first_.EndOfRun(run->end);
    counters_->potential_hits += run->end - run->from;
    const uint32_t asked = Meet(*run, outlines);
    SettledRays settled;
    first_.Settle(RaysOf(*run), ranges_ + run->from, &settled);
    for (uint32_t from = run->from; from < run->end; from++) {
      const uint32_t other = run->from + settled.FirstOther(from - run->from);
      EndAtOutlines(run->Some(from, std::min(other, run->end)), asked == 1);
      if (other >= run->end) return;
      from = other;
      GoOnExactly(*run, from);
    }
  }

  /// True if a ray meets the same in both tiles.
  bool HaveSameOutlines(grid::OutlineList a, grid::OutlineList b) const {
    if (b == FirstHits::kNothing) return false;
    const grid::OutlinePart &of_a = tracer_.grid_.outline(a), &of_b = tracer_.grid_.outline(b);
    return of_a.next == 0 && of_b.next == 0 && of_a.id == of_b.id && of_a.edges == of_b.edges;
  }

  OutlineRays RaysOf(const Run& run) const {
    const Fan& fan = *fans_[run.part];
    const uint32_t sample = SampleOf(run, run.from);
    return {&fan, batch_.DirectionsOf(fan) + sample, batch_.TurnsOf(fan) + sample,
            &first_.Packed(run.from), run.end - run.from};
  }

  /// Finds out which outlines the rays meet, and where. Returns how many were asked.
  uint32_t Meet(const Run& run, grid::OutlineList outlines) {
    const Fan& fan = *fans_[run.part];
    const OutlineRays rays = RaysOf(run);
    double* const ranges = ranges_ + run.from;
    uint32_t asked = 0;
    tracer_.grid_.ForEachOutline(outlines, [&](const grid::OutlinePart& part) {
      const grid::Body& body = tracer_.grid_.body(part.id);
      if (PassesAboveOrBelow(fan, body)) return;
      if (!fan.predicate(body.model, fan.finder, fan.arg)) return;
      const OutlineEdges edges{body.corners, part.edges};
      if (asked++ == 0) {
        first_.Meet(rays, edges, ranges);
        std::fill(met_ + run.from, met_ + run.end, &body);
      } else {
        first_.Meet(rays, edges, others_);
        for (uint32_t i = 0; i < rays.count; i++) {
          const grid::Body*& met = met_[run.from + i];
          if (!IsNearer(others_[i], body, ranges[i], *met)) continue;
          ranges[i] = others_[i];
          met = &body;
        }
      }
    });
    if (asked == 0)
      std::fill(ranges, ranges + rays.count, std::numeric_limits<double>::infinity());
    return asked;
  }

  /// The rays have met outlines, and nothing else before; all the same one, if so said.
  void EndAtOutlines(Run run, bool same) {
    const uint32_t end = run.end;
    if (same && run.from < end) return End(run, met_[run.from]->model);
    while (run.from < end) {
      Model* const hit = met_[run.from]->model;
      run.end = run.from + 1;
      while (run.end < end && met_[run.end]->model == hit) run.end++;
      End(run, hit);
      run.from = run.end;
    }
  }

  /// A ray that may meet something nearer, outside the tile of its potential hit.
  void GoOnExactly(const Run& run, uint32_t ray) {
    const Fan& fan = *fans_[run.part];
    const SineCosine& turn = batch_.TurnsOf(fan)[SampleOf(run, ray)];
    const bool has_met = IsWithin(ranges_[ray], fan.range);
    const grid::Body* const met = has_met ? met_[ray] : nullptr;
    EndAt(run, ray, tracer_.TraceExactFrom(fan, WalkOn(run, ray), turn, met, ranges_[ray]));
  }

  /// How a ray is walked on from its first potential hit.
  Walk WalkOn(const Run& run, uint32_t ray) const {
    HitList list{&first_.Packed(ray), 1, 0};
    if (lists_.per_ray > 0)
      list = {parts_[run.part].walked + lists_.WordsOf(ray - run.first) + 1, lists_.per_ray, 1};
    const Fan& fan = *fans_[run.part];
    return WalkOf(fan, view_, batch_.DirectionsOf(fan)[SampleOf(run, ray)], mask_, list, counters_);
  }
  /// A single ray of the run has hit this.
  void EndAt(const Run& run, uint32_t ray, const RayHit& hit) {
    ranges_[ray] = hit.range;
    End(run.Some(ray, ray + 1), hit.model);
  }

  const Tracer& tracer_;
  const RayBatch& batch_;
  const HitLists& lists_;
  double* ranges_;  // of the rays to come
  std::vector<HitRun>& runs_;
  TraceCounters* counters_;
  FirstHits first_;
  ray_grid_t view_;
  ray_mask_t mask_;

  uint32_t part_count_ = 0, rays_ = 0;
  const Fan* fans_[RayGroup::kMost];
  uint32_t begins_[RayGroup::kMost];  // ray of the fan that a part begins with
  FanPart parts_[RayGroup::kMost];
  // Of rays of the exact model:
  const grid::Body* met_[RayGroup::kMost];  // the outlines that they meet first
  double others_[RayGroup::kMost];          // where they meet another one
};

/// Rays of several legs, which no device walks, or of none.
void Tracer::TraceOneByOne(const RayBatch& batch, const Fan& fan, double* ranges,
                           std::vector<HitRun>* runs, TraceCounters* counters) const {
  const Direction* directions = batch.DirectionsOf(fan);
  const SineCosine* turns = batch.TurnsOf(fan);
  const ray_mask_t mask = batch.SelfMaskOf(fan);
  const ray_grid_t view = grid_.View(fan.layer);
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
  if (hits->ranges.size() < rays + Hits::kRoom) hits->ranges.resize(rays + Hits::kRoom);
  hits->runs.clear();
  Group group(*this, batch, lists, hits, counters);
  for (const Fan& fan : fans) {
    if (fan.single_leg())
      group.Add(fan);
    else
      group.AddAlone(fan);
  }
  group.Trace();
}

}  // namespace Stg::internal::sensing
