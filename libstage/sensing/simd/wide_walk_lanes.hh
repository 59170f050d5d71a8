// SPDX-License-Identifier: GPL-2.0-or-later
//
// The walk in the lanes of a vector. Each file wide_walk_*.cc includes this header for one kind of
// vector and is compiled for processors that have it. No code from here may be shared with files
// for other processors. Hence the unnamed namespace, and no function of the standard library.
//
// `Lanes` is a class of static functions on vectors V of 64-bit integers, D of doubles and masks M.
// The walk itself uses 32-bit lanes, with vectors F of floats and Words of 64 bits. Algorithm and
// names are those of ray_walk.h.

#ifndef STAGE_SENSING_SIMD_WIDE_WALK_LANES_HH
#define STAGE_SENSING_SIMD_WIDE_WALK_LANES_HH

#include "sensing/block_map.hh"
#include "sensing/free_box.hh"
#include "sensing/simd/wide_hits.hh"
#include "sensing/simd/wide_outlines.hh"
#include "sensing/simd/wide_rays.hh"
#include "sensing/simd/wide_walk.hh"

namespace Stg::internal::sensing {
namespace {

/// Slope and offsets of rays, as in ray_t.
template <class Lanes>
struct Slant {
  typename Lanes::V ox, oy, adx, ady;
  typename Lanes::F dy_per_dx, dx_per_dy;
};

/// A border, in Q16, that no ray reaches: the longest ray plus a superregion.
constexpr float kBeyond = 1.2e9f;

/// Distance in Q16 from the start to a border.
template <class Lanes>
typename Lanes::V Offset(typename Lanes::V border, typename Lanes::V start) {
  return Lanes::Subtract(Lanes::template Left<16>(border), start);
}

/// ray_leap_end(): sets u and v to where a leap across the border to_x (if `in_x`) or to_y lands.
/// The float guess is accurate to a hundredth of a border.
template <class Lanes>
void Leap(const Slant<Lanes>& ray, typename Lanes::M in_x, typename Lanes::V to_x,
          typename Lanes::V to_y, typename Lanes::V* u, typename Lanes::V* v) {
  using V = typename Lanes::V;
  const V to = Lanes::Select(in_x, to_x, to_y);
  const V other_offset = Lanes::Select(in_x, ray.oy, ray.ox);
  const V across = Lanes::Select(in_x, ray.adx, ray.ady);
  const V along = Lanes::Select(in_x, ray.ady, ray.adx);
  const V from = Lanes::Select(in_x, *v, *u), one = Lanes::All(1);
  const V at = Offset<Lanes>(to, Lanes::Select(in_x, ray.ox, ray.oy));
  const auto slope = Lanes::Select(in_x, ray.dy_per_dx, ray.dx_per_dy);
  // Clamp: beyond the end of any ray the exact place does not matter.
  const auto guess = Lanes::Smaller(Lanes::Times(Lanes::ToFloat(at), slope), Lanes::AllOf(kBeyond));
  // Subtract twice the error of the guess, so that it surely lies before the place.
  const V before = Lanes::Add(Lanes::Add(Lanes::ToInteger(guess), other_offset), Lanes::All(-512));
  V n = Lanes::Larger(Lanes::template Right<16>(before), from);
  const V next = Offset<Lanes>(Lanes::Add(n, one), other_offset);
  n = Lanes::AddWhere(Lanes::ProductsBelow(next, across, at, along, in_x), n, one);
  *u = Lanes::Select(in_x, to, n);
  *v = Lanes::Select(in_x, n, to);
}

/// Rays prepared for the walk, as by ray_begin().
template <class Lanes, class Narrow>
class ReadyRays : public RayStarts<Lanes> {
 public:
  using V = typename Lanes::V;
  using D = typename Lanes::D;
  using M = typename Lanes::M;
  using RayStarts<Lanes>::kCapacity;

  explicit ReadyRays(const RayGroup& rays)
      : RayStarts<Lanes>(rays), mask(*rays.mask), free_(FindFreeBoxesIfWorthwhile(rays)) {
    for (uint32_t first = 0; first < this->count; first += Lanes::kCount) Prepare(first);
    for (uint32_t first = 0; first < this->count; first += Narrow::kCount) LeaveFreeBox(first);
  }

  const ray_mask_t& mask;
  uint32_t next = 0;  ///< index of the next ray to begin

  alignas(64) int32_t limits_x[kCapacity], limits_y[kCapacity];
  alignas(64) float dy_per_dx[kCapacity], dx_per_dy[kCapacity];
  alignas(64) int32_t u[kCapacity], v[kCapacity];  ///< position where the walk begins

 private:
  static V All(int64_t number) { return Lanes::All(number); }

  void Prepare(uint32_t first) {
    const auto load = [&](const int32_t* numbers) { return Lanes::Load(numbers + first); };
    const ray_grid_t& box = this->grid;
    const V to_x = load(this->dx), to_y = load(this->dy);
    const V adx = Lanes::Absolute(to_x), ady = Lanes::Absolute(to_y);
    Lanes::Store(limits_x + first,
                 Limit(to_x, adx, load(this->ox), load(this->x0), box.min_x, box.max_x));
    Lanes::Store(limits_y + first,
                 Limit(to_y, ady, load(this->oy), load(this->y0), box.min_y, box.max_y));
    const D across = Lanes::ToDouble(adx), along = Lanes::ToDouble(ady);
    Lanes::Store(dy_per_dx + first, Lanes::DivideOr0(along, across));
    Lanes::Store(dx_per_dy + first, Lanes::DivideOr0(across, along));
  }

  /// Begins the walk where the ray leaves the free box, or at its start if that lies outside.
  void LeaveFreeBox(uint32_t first) {
    using N = typename Narrow::V;
    const auto load = [&](const auto* numbers) { return Narrow::Load(numbers + first); };
    const N to_x = load(this->dx), to_y = load(this->dy);
    const N none = Narrow::All(0), one = Narrow::All(1);
    const auto back_x = Narrow::Greater(none, to_x), back_y = Narrow::Greater(none, to_y);
    const auto side = [&](int32_t grid::CellBox::*of) {
      const auto row = [&](const grid::CellBox(&boxes)[2]) {
        return Narrow::Select(back_x, Narrow::All(boxes[1].*of), Narrow::All(boxes[0].*of));
      };
      return Narrow::Select(back_y, row(free_.towards[1]), row(free_.towards[0]));
    };
    const N x = load(this->x0), y = load(this->y0);
    const N min_x = side(&grid::CellBox::min_x), max_x = side(&grid::CellBox::max_x);
    const N min_y = side(&grid::CellBox::min_y), max_y = side(&grid::CellBox::max_y);
    // Comparisons, because the distance to a far box may overflow.
    const auto outside =
        Narrow::Or(Narrow::Or(Narrow::Greater(min_x, x), Narrow::Greater(x, max_x)),
                   Narrow::Or(Narrow::Greater(min_y, y), Narrow::Greater(y, max_y)));
    const auto border = [&](auto back, N start, N min, N max) {
      return Narrow::Add(
          Narrow::Select(back, Narrow::Subtract(start, min), Narrow::Subtract(max, start)), one);
    };
    const N border_x = border(back_x, x, min_x, max_x), border_y = border(back_y, y, min_y, max_y);
    const Slant<Narrow> ray{load(this->ox),         load(this->oy),  Narrow::Absolute(to_x),
                            Narrow::Absolute(to_y), load(dy_per_dx), load(dx_per_dy)};
    const auto in_x =
        Narrow::ProductsBelow(Offset<Narrow>(border_x, ray.ox), ray.ady,
                              Offset<Narrow>(border_y, ray.oy), ray.adx, Narrow::None());
    N over_x = none, over_y = none;
    Leap<Narrow>(ray, in_x, border_x, border_y, &over_x, &over_y);
    Narrow::Store(u + first, Narrow::Select(outside, none, over_x));
    Narrow::Store(v + first, Narrow::Select(outside, none, over_y));
  }

  /// ray_limit() in lanes.
  static V Limit(V displacement, V size, V offset, V start, int64_t low, int64_t high) {
    const V none = All(0);
    const M back = Lanes::Greater(none, displacement);
    const V cells =
        Lanes::Select(back, Lanes::Subtract(start, All(low)), Lanes::Subtract(All(high), start));
    const V border = Lanes::Subtract(Lanes::template Left<16>(cells), offset);
    const M to_end =
        Lanes::Or(Lanes::Greater(cells, All(RAY_LEG_CELLS)), Lanes::Greater(border, size));
    return Lanes::Select(Lanes::Greater(none, cells), All(RAY_LIMIT_BEHIND_START),
                         Lanes::Select(to_end, size, border));
  }

  const FreeBoxes free_;
};

/// Rays that walk in lock-step, in 32-bit lanes. A lane whose ray has ended takes the next ray.
template <class Lanes, class Rays>
class LaneGroup {
 public:
  LaneGroup(Rays* rays, const SuperMap<Lanes>& supers, BlockMap<Lanes>* blocks, uint32_t* hits)
      : rays_(*rays), supers_(supers), blocks_(*blocks), hits_(hits) {}

  bool IsActive() const { return Lanes::Any(active_); }

  /// Begins the next rays in free lanes, if enough lanes are free for that to pay.
  void RefillLanes() {
    const uint32_t left = rays_.count - rays_.next;
    M taken = Lanes::Not(active_);
    const auto free_lanes = static_cast<uint32_t>(Lanes::CountOf(taken));
    if (left == 0 || free_lanes < kMinFreeLanes) return;
    if (left < free_lanes) taken = Lanes::First(taken, static_cast<int>(left));
    Begin(taken);
    rays_.next += left < free_lanes ? left : free_lanes;
    active_ = Lanes::Or(active_, taken);
  }

  /// Loads the grid's data at the rays' positions. Mostly waits for memory.
  void LoadPositions() {
    x_ = Reached<Lanes>(x0_, u_, back_x_);
    y_ = Reached<Lanes>(y0_, v_, back_y_);
    super_ = supers_.Of(active_, x_, y_);
    const V region = RegionOf<Lanes>(rays_.grid, super_, x_, y_);
    const V t = TileInRegion<Lanes>(x_, y_);
    squares_ = Lanes::Gather(rays_.grid.tile_maps, region);
    const V tile = Lanes::Add(Lanes::template Left<6>(region), t);
    word_ = Visible(Lanes::Odd(Lanes::BitOf(squares_, t)), tile);
    in_block_ = Lanes::Zero(squares_);
    const M look_up = Lanes::And(active_, in_block_);
    if (Lanes::Any(look_up))
      squares_ = Lanes::Select(in_block_, blocks_.Of(look_up, super_, x_, y_), squares_);
  }

  /// After LoadPositions(): advances each ray by one leap, or by one walk within a word.
  void Advance() {
    const V none = All(0), one = All(1), seven = All(7);
    // The squares to walk in: cells of a tile, tiles of a region, regions of a block; or a leap.
    const M leaps = Lanes::Zero(squares_), in_tile = Lanes::Not(Lanes::Zero(word_));
    const V leap_shift =
        Lanes::Select(Lanes::Equal(super_, none), All(RAY_SUPER_SHIFT), All(RAY_BLOCK_SHIFT));
    const V walk_shift = Lanes::Select(in_block_, All(RAY_REGION_SHIFT),
                                       Lanes::Select(in_tile, none, All(RAY_TILE_SHIFT)));
    const V shift = Lanes::Select(leaps, leap_shift, walk_shift);
    const V square_x = Lanes::ShiftRight(x_, shift), square_y = Lanes::ShiftRight(y_, shift);
    const V bit = Lanes::Or(Lanes::And(square_x, seven),
                            Lanes::template Left<3>(Lanes::And(square_y, seven)));

    // The next borders of the square. The number of cells to its far side is inner & ~(x ^ back).
    const V inner = Lanes::Subtract(Lanes::ShiftLeft(one, shift), one);
    const V to_x = Lanes::Add(Lanes::Add(u_, one), Lanes::Without(inner, Lanes::Xor(x_, back_x_)));
    const V to_y = Lanes::Add(Lanes::Add(v_, one), Lanes::Without(inner, Lanes::Xor(y_, back_y_)));
    const V near_x = Lanes::And(Lanes::Xor(square_x, back_x_), seven);
    const V near_y = Lanes::And(Lanes::Xor(square_y, back_y_), seven);
    // Steps change e by multiples of 2^16 squares: lower bits never affect its sign, and the others
    // fit in 31 bits.
    const V e = Lanes::ProductsRight(Offset(to_x, ox_), ady_, Offset(to_y, oy_), adx_,
                                     Lanes::Add(shift, All(16)));
    const V at = Lanes::Add(
        Lanes::Add(bit, All(kInside)),
        Lanes::Add(Lanes::template Left<kFieldX>(near_x), Lanes::template Left<kFieldY>(near_y)));
    const M stands = Lanes::And(in_tile, Lanes::Odd(Lanes::BitOf(word_, bit)));
    const auto [last_in, last_at] = WalkInWord({Lanes::Select(in_tile, word_, squares_), e, at},
                                               Lanes::AndNot(active_, Lanes::Or(leaps, stands)));
    in_hit_ = Lanes::And(in_tile, Lanes::Zero(Lanes::And(last_at, All(kOutside))));
    const V far_x = Lanes::And(Lanes::template Right<kFieldX>(last_at), All(15));
    const V far_y = Lanes::And(Lanes::template Right<kFieldY>(last_at), All(15));
    const V steps_x = Lanes::Subtract(far_x, near_x), steps_y = Lanes::Subtract(far_y, near_y);
    const V u_counted = Lanes::Add(u_, steps_x), v_counted = Lanes::Add(v_, steps_y);
    Leap<Lanes>({ox_, oy_, adx_, ady_, dy_per_dx_, dx_per_dy_}, Lanes::MaskOf(last_in),
                Lanes::Add(to_x, Lanes::ShiftLeft(Lanes::DecrementOr0(steps_x), shift)),
                Lanes::Add(to_y, Lanes::ShiftLeft(Lanes::DecrementOr0(steps_y), shift)), &u_, &v_);
    // In a tile the counted steps suffice.
    u_ = Lanes::Select(in_tile, u_counted, u_);
    v_ = Lanes::Select(in_tile, v_counted, v_);
  }

  /// Stores the hits of rays that have ended and frees their lanes.
  void Report() {
    const M beyond = Lanes::Or(Lanes::Greater(Offset(u_, ox_), limit_x_),
                               Lanes::Greater(Offset(v_, oy_), limit_y_));
    const M ended = Lanes::And(active_, Lanes::Or(in_hit_, beyond));
    if (!Lanes::Any(ended)) return;
    const V hit = Lanes::Or(u_, Lanes::template Left<16>(v_));
    Lanes::Scatter(ended, hits_, ray_,
                   Lanes::Select(beyond, All(static_cast<int32_t>(RAY_NO_HIT)), hit));
    active_ = Lanes::AndNot(active_, ended);
  }

 private:
  using V = typename Lanes::V;
  using F = typename Lanes::F;
  using M = typename Lanes::M;
  using Words = typename Lanes::Words;

  /// Minimum number of free lanes to refill.
  static constexpr uint32_t kMinFreeLanes = Lanes::kCount / 4;

  /// State of a walk within a word of 8 x 8 squares, packed into one number so that a step is one
  /// addition. It has the square's bit, plus 128 to keep it positive, and above it two fields with
  /// the distances of the square from the near side of the word in x and y. A field of 8 means that
  /// the ray has left the word.
  static constexpr int kFieldX = 16, kFieldY = 24;
  static constexpr int32_t kInside = 128;
  static constexpr int32_t kOutside = 8 << kFieldX | 8 << kFieldY;

  struct WordWalk {
    Words squares;
    V e, at;  // initial values
  };
  struct WordEnd {
    V in, at;  // direction of the last step, and the state after it
  };

  static V All(int32_t number) { return Lanes::All(number); }
  static V Offset(V border, V start) { return sensing::Offset<Lanes>(border, start); }

  void Begin(M taken) {
    const auto places = Lanes::PlacesOf(taken);
    const auto load = [&](const auto* numbers, auto* lanes) {
      *lanes = Lanes::Expand(taken, places, numbers + rays_.next, *lanes);
    };
    V dx = All(0), dy = All(0);
    load(rays_.x0, &x0_);
    load(rays_.y0, &y0_);
    load(rays_.dx, &dx);
    load(rays_.dy, &dy);
    load(rays_.ox, &ox_);
    load(rays_.oy, &oy_);
    load(rays_.limits_x, &limit_x_);
    load(rays_.limits_y, &limit_y_);
    load(rays_.u, &u_);
    load(rays_.v, &v_);
    load(rays_.dy_per_dx, &dy_per_dx_);
    load(rays_.dx_per_dy, &dx_per_dy_);
    ray_ = Lanes::Select(taken, Lanes::Rank(places, rays_.next), ray_);
    adx_ = Lanes::Select(taken, Lanes::Absolute(dx), adx_);
    ady_ = Lanes::Select(taken, Lanes::Absolute(dy), ady_);
    back_x_ = Lanes::Select(taken, Lanes::SignOf(dx), back_x_);
    back_y_ = Lanes::Select(taken, Lanes::SignOf(dy), back_y_);
    const V forth_x = Lanes::Or(back_x_, All(1)), forth_y = Lanes::Or(back_y_, All(1));
    to_next_y_ = Lanes::Add(Lanes::template Left<3>(forth_y), All(1 << kFieldY));
    to_next_x_ = Lanes::Subtract(Lanes::Add(forth_x, All(1 << kFieldX)), to_next_y_);
  }

  /// Walks the rays of `go` to an occupied square or out of the word. All lanes step until the last
  /// one stops, so that no step depends on which lanes have stopped. Their results are kept aside.
  WordEnd WalkInWord(const WordWalk& walk, M go) const {
    const V outside = All(kOutside), both = Lanes::Add(adx_, ady_);
    V e = walk.e, at = walk.at;
    WordEnd end{Lanes::SignOf(e), at};
    while (Lanes::Any(go)) {
      const V in = Lanes::SignOf(e);
      e = Lanes::Add(Lanes::Subtract(e, adx_), Lanes::And(both, in));
      at = Lanes::Add(at, Lanes::Add(to_next_y_, Lanes::And(to_next_x_, in)));
      end.in = Lanes::Select(go, in, end.in);
      end.at = Lanes::Select(go, at, end.at);
      const V found = Lanes::BitOf(walk.squares, at);
      go = Lanes::And(go, Lanes::Zero(Lanes::OddOr(found, Lanes::And(at, outside))));
    }
    return end;
  }

  /// The words of the tiles, without cells that the self-mask hides. Lanes outside `to_look` are 0.
  Words Visible(M to_look, V tile) const {
    const ray_mask_t& mask = rays_.mask;
    const Words word = Lanes::Gather(to_look, rays_.grid.tiles, tile);
    const V width = All(static_cast<int32_t>(mask.width));
    const V wx = Lanes::Subtract(Lanes::template Right<RAY_TILE_SHIFT>(x_), All(mask.x));
    const V wy = Lanes::Subtract(Lanes::template Right<RAY_TILE_SHIFT>(y_), All(mask.y));
    const M covered = Lanes::And(Lanes::And(to_look, Lanes::Below(wx, width)),
                                 Lanes::Below(wy, All(static_cast<int32_t>(mask.height))));
    if (!Lanes::Any(covered)) return word;
    const V index = Lanes::Add(Lanes::Multiply(wy, width), wx);
    return Lanes::Without(word, Lanes::Gather(covered, mask.tiles, index));
  }

  Rays& rays_;
  const SuperMap<Lanes>& supers_;
  BlockMap<Lanes>& blocks_;
  uint32_t* hits_;
  M active_ = Lanes::None();

  // Constants of the ray in each lane.
  V ray_ = All(0);  // index of the ray
  V x0_ = All(0), y0_ = All(0), adx_ = All(0), ady_ = All(0);
  V back_x_ = All(0), back_y_ = All(0);  // all ones if it travels backwards
  V ox_ = All(0), oy_ = All(0), limit_x_ = All(0), limit_y_ = All(0);
  F dy_per_dx_ = Lanes::AllOf(0), dx_per_dy_ = Lanes::AllOf(0);
  V to_next_y_ = All(0), to_next_x_ = All(0);  // step in y; change to a step in x

  // Position, and the results of LoadPositions().
  V u_ = All(0), v_ = All(0), x_ = All(0), y_ = All(0);
  V super_ = All(0);
  Words squares_{}, word_{};  // of the region or block, and of the tile
  M in_block_ = Lanes::None();
  M in_hit_ = Lanes::None();
};

/// Alternates between two groups, so that one computes while the other waits for memory. Rays are
/// prepared and hits evaluated in 64-bit lanes, and walked in 32-bit lanes.
template <class Lanes, class Narrow>
void WalkInLanes(const RayGroup& rays, const grid::Grid::Tables& tables, const WideHits& found) {
  using Ready = ReadyRays<Lanes, Narrow>;
  Ready ready(rays);
  const SuperMap<Narrow> supers = SupersNear<Narrow>(rays);
  BlockMap<Narrow> blocks(*rays.grid, supers, rays.slices[0].fan->x, rays.slices[0].fan->y);
  LaneGroup<Narrow, Ready> first(&ready, supers, &blocks, found.hits);
  LaneGroup<Narrow, Ready> second(&ready, supers, &blocks, found.hits);
  first.RefillLanes();
  second.RefillLanes();
  first.LoadPositions();
  while (first.IsActive()) {
    second.LoadPositions();
    first.Advance();
    first.Report();
    first.RefillLanes();
    first.LoadPositions();
    second.Advance();
    second.Report();
    second.RefillLanes();
  }
  while (second.IsActive()) {
    second.LoadPositions();
    second.Advance();
    second.Report();
  }
  HitPlaces<Lanes>(ready, tables).Find(SupersNear<Lanes>(rays, supers), found);
  FindEnds<Lanes>(rays.count, found);
}

}  // namespace
}  // namespace Stg::internal::sensing

#endif
