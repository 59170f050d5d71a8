// SPDX-License-Identifier: GPL-2.0-or-later
//
// The walk itself, in terms of the lanes of a vector. Included by one file for each kind of vector,
// which is compiled for processors that have it: nothing in here may end up in code that others run
// too. Hence the nameless namespace, and no function of the standard library.
//
// `Lanes` is a class of static functions on vectors V of 64-bit integers, D of doubles and masks M.
// What is what, and why, is told in ray_walk.h; names are the same.

#ifndef STAGE_SENSING_WIDE_WALK_LANES_HH
#define STAGE_SENSING_WIDE_WALK_LANES_HH

#include "sensing/fan.hh"
#include "sensing/wide_walk.hh"

namespace Stg::internal::sensing {
namespace {

/// The rays of a fan, ready to be walked.
template <class Lanes>
struct FanRays {
  using V = typename Lanes::V;
  using D = typename Lanes::D;
  using M = typename Lanes::M;

  FanRays(const WideRays& rays, WideHits* where)
      : grid(*rays.grid), window(*rays.window), fan(*rays.fan), count(rays.count), hits(*where) {
    for (uint32_t first = 0; first < count; first += Lanes::kCount)
      Prepare(rays.directions + first, first);
  }

  /// As ray_begin() does, for the rays from `first` on.
  void Prepare(const Direction* directions, uint32_t first) {
    V cosines, sines;
    Lanes::LoadPairs(directions, count - first, &cosines, &sines);
    const V cosine = All(fan.cosine), sine = All(fan.sine), half = All(int64_t{1} << 29);
    const V x = Lanes::Subtract(Lanes::Multiply(cosine, cosines), Lanes::Multiply(sine, sines));
    const V y = Lanes::Add(Lanes::Multiply(sine, cosines), Lanes::Multiply(cosine, sines));
    const V dx = Lanes::template Right<30>(Lanes::Add(x, half));
    const V dy = Lanes::template Right<30>(Lanes::Add(y, half));
    Lanes::Store(hits.dx + first, dx);
    Lanes::Store(hits.dy + first, dy);
    const V adx = Lanes::Absolute(dx), ady = Lanes::Absolute(dy);
    const V limit_x = Limit(dx, adx, fan.fraction & 0xffff, fan.x, grid.min_x, grid.max_x);
    const V limit_y = Limit(dy, ady, fan.fraction >> 16, fan.y, grid.min_y, grid.max_y);
    Lanes::Store(limits_x + first, limit_x);
    Lanes::Store(limits_y + first, limit_y);
    const D across = Lanes::ToDouble(adx), along = Lanes::ToDouble(ady);
    Lanes::Store(dy_per_dx + first, Lanes::DivideOr0(along, across));
    Lanes::Store(dx_per_dy + first, Lanes::DivideOr0(across, along));
  }

  /// ray_limit().
  static V Limit(V displacement, V size, int64_t fraction, int64_t start, int64_t low,
                 int64_t high) {
    const V none = All(0);
    const M back = Lanes::Greater(none, displacement);
    const V cells = Lanes::Select(back, All(start - low), All(high - start));
    const V offset = Lanes::Select(back, All(65536 - fraction), All(fraction));
    const V border = Lanes::Subtract(Lanes::template Left<16>(cells), offset);
    const M to_end =
        Lanes::Or(Lanes::Greater(cells, All(RAY_LEG_CELLS)), Lanes::Greater(border, size));
    return Lanes::Select(Lanes::Greater(none, cells), All(RAY_BEHIND),
                         Lanes::Select(to_end, size, border));
  }

  static V All(int64_t number) { return Lanes::All(number); }

  const ray_grid_t& grid;
  const ray_window_t& window;
  const FanRecord& fan;
  const uint32_t count;
  WideHits& hits;
  alignas(64) int64_t limits_x[WideRays::kMost], limits_y[WideRays::kMost];
  alignas(64) double dy_per_dx[WideRays::kMost], dx_per_dy[WideRays::kMost];
  uint32_t next = 0;  ///< the ray to be taken up
};

/// Rays of a fan that are walked side by side. A lane whose ray has ended takes up the next one.
template <class Lanes>
class LaneGroup {
 public:
  explicit LaneGroup(FanRays<Lanes>* rays) : rays_(*rays) {}

  bool AtWork() const { return Lanes::Any(active_); }

  /// Begins the next rays in lanes that have none, if there are enough of these to stop for it.
  void TakeUp() {
    const uint32_t left = rays_.count - rays_.next;
    M taken = Lanes::Not(active_);
    const auto room = static_cast<uint32_t>(Lanes::CountOf(taken));
    if (left == 0 || room < kRoom) return;
    if (left < room) taken = Lanes::First(taken, static_cast<int>(left));
    SetDirections(taken);
    SetStart(taken);
    rays_.next += left < room ? left : room;
    active_ = Lanes::Or(active_, taken);
  }

  /// Looks up what there is where the rays are. Takes its time: the numbers wait for memory.
  void Look() {
    x_ = Lanes::Add(All(rays_.fan.x), Lanes::Subtract(Lanes::Xor(u_, back_x_), back_x_));
    y_ = Lanes::Add(All(rays_.fan.y), Lanes::Subtract(Lanes::Xor(v_, back_y_), back_y_));
    FindSupers();
    const V in_super = Lanes::Or(Lanes::And(Lanes::template Right<2>(y_), All(0xf0)),
                                 Lanes::And(Lanes::template Right<6>(x_), All(0x0f)));
    const V place = Lanes::Add(Lanes::template Left<8>(super_), in_super);
    const V region = Lanes::Gather(rays_.grid.regions, place);
    tile_map_ = Lanes::Gather(rays_.grid.tile_maps, region);
    const V t =
        Lanes::Or(Lanes::And(y_, All(0x38)), Lanes::And(Lanes::template Right<3>(x_), All(7)));
    tile_ = Lanes::Add(Lanes::template Left<6>(region), t);
    word_ = Visible(Lanes::Odd(Lanes::TurnRight(tile_map_, t)), x_, y_);
  }

  /// One leap, or one walk within a tile or a region, of each ray, after Look().
  void GoOn() {
    const V none = All(0), one = All(1), seven = All(7);
    // What to walk in: the cells of a tile, the tiles of a region, or nothing but a leap.
    const M in_tile = Lanes::Differ(word_, none), leaps = Lanes::Equal(tile_map_, none);
    const V leap_shift =
        Lanes::Select(Lanes::Equal(super_, none), All(RAY_SUPER_SHIFT), All(RAY_REGION_SHIFT));
    const V walk_shift = Lanes::Select(in_tile, none, All(RAY_TILE_SHIFT));
    const V shift = Lanes::Select(leaps, leap_shift, walk_shift);
    const V square_x = Lanes::ShiftRight(x_, shift), square_y = Lanes::ShiftRight(y_, shift);
    const V bit = Lanes::Or(Lanes::And(square_x, seven),
                            Lanes::template Left<3>(Lanes::And(square_y, seven)));
    // The tile that it is in holds nothing that counts, if it walks from tile to tile.
    const V squares =
        Lanes::Select(in_tile, word_, Lanes::Without(tile_map_, Lanes::ShiftLeft(one, bit)));

    // The next borders of the square. Cells left to its far side: those to its near side, counted
    // from the other end.
    const V inner = Lanes::Subtract(Lanes::ShiftLeft(one, shift), one);
    const V to_x = Lanes::Add(Lanes::Add(u_, one), Lanes::Without(inner, Lanes::Xor(x_, back_x_)));
    const V to_y = Lanes::Add(Lanes::Add(v_, one), Lanes::Without(inner, Lanes::Xor(y_, back_y_)));
    V e = Lanes::Subtract(Lanes::Multiply(Offset(to_x, ox_), ady_),
                          Lanes::Multiply(Offset(to_y, oy_), adx_));
    const V ey = Lanes::ShiftLeft(ey_, shift), ex_ey = Lanes::ShiftLeft(ex_ey_, shift);
    const V near_x = Lanes::And(Lanes::Xor(square_x, back_x_), seven);
    const V near_y = Lanes::And(Lanes::Xor(square_y, back_y_), seven);
    V at = Lanes::Add(
        Lanes::Add(bit, All(kInside)),
        Lanes::Add(Lanes::template Left<kFieldX>(near_x), Lanes::template Left<kFieldY>(near_y)));

    // All lanes go on until the last one stops, so that the next step need not wait for who stops
    // where: that is noted beside it.
    const V outside = All(kOutside);
    const M stands = Lanes::And(in_tile, Lanes::Odd(Lanes::TurnRight(word_, bit)));
    M go = Lanes::AndNot(active_, Lanes::Or(leaps, stands));
    V last_in = Lanes::SignOf(e), last_at = at;
    while (Lanes::Any(go)) {
      const V in = Lanes::SignOf(e);
      e = Lanes::Add(Lanes::Subtract(e, ey), Lanes::And(ex_ey, in));
      at = Lanes::Add(at, Lanes::Add(to_next_y_, Lanes::And(to_next_x_, in)));
      last_in = Lanes::Select(go, in, last_in);
      last_at = Lanes::Select(go, at, last_at);
      const V found = Lanes::TurnRight(squares, at);
      go = Lanes::And(go, Lanes::Zero(Lanes::OddOr(found, Lanes::And(at, outside))));
    }
    in_hit_ = Lanes::And(in_tile, Lanes::Zero(Lanes::And(last_at, outside)));
    const V far_x = Lanes::And(Lanes::template Right<kFieldX>(last_at), All(15));
    const V far_y = Lanes::And(Lanes::template Right<kFieldY>(last_at), All(15));
    const V steps_x = Lanes::Subtract(far_x, near_x), steps_y = Lanes::Subtract(far_y, near_y);
    const V u_counted = Lanes::Add(u_, steps_x), v_counted = Lanes::Add(v_, steps_y);
    Land(Lanes::MaskOf(last_in), Lanes::Add(to_x, Lanes::template Left<3>(Lanes::LessOne(steps_x))),
         Lanes::Add(to_y, Lanes::template Left<3>(Lanes::LessOne(steps_y))));
    // In a tile it is enough to count.
    u_ = Lanes::Select(in_tile, u_counted, u_);
    v_ = Lanes::Select(in_tile, v_counted, v_);
  }

  /// Writes down where rays have ended, if any have.
  void Report() {
    const M beyond = Lanes::Or(Lanes::Greater(Offset(u_, ox_), limit_x_),
                               Lanes::Greater(Offset(v_, oy_), limit_y_));
    const M ended = Lanes::And(active_, Lanes::Or(in_hit_, beyond));
    if (!Lanes::Any(ended)) return;
    const V hit = Lanes::Or(u_, Lanes::template Left<16>(v_));
    Lanes::Scatter(ended, rays_.hits.hits, ray_, Lanes::Select(beyond, All(RAY_NO_HIT), hit));
    Lanes::Scatter(ended, rays_.hits.tiles, ray_, tile_);
    active_ = Lanes::AndNot(active_, ended);
  }

 private:
  using V = typename Lanes::V;
  using D = typename Lanes::D;
  using M = typename Lanes::M;

  /// Room for fewer rays is not filled while others are at work.
  static constexpr uint32_t kRoom = Lanes::kCount / 2;

  /// A walk within a word of 8 x 8 squares, in one number, so that a step is one addition: the
  /// square's bit, plus 64 so that it can't become negative, and in the two fields above it how far
  /// the square is from the near side of the word in x and y. These reach 8 outside.
  static constexpr int kFieldX = 16, kFieldY = 32;
  static constexpr int64_t kInside = 64;
  static constexpr int64_t kOutside = int64_t{8} << kFieldX | int64_t{8} << kFieldY;

  static V All(int64_t number) { return Lanes::All(number); }
  static V Offset(V border, V start) {
    return Lanes::Subtract(Lanes::template Left<16>(border), start);
  }

  void SetDirections(M taken) {
    const auto load = [&](const auto* numbers, auto* lanes) {
      *lanes = Lanes::Expand(taken, numbers + rays_.next, *lanes);
    };
    load(rays_.hits.dx, &dx_);
    load(rays_.hits.dy, &dy_);
    load(rays_.limits_x, &limit_x_);
    load(rays_.limits_y, &limit_y_);
    load(rays_.dy_per_dx, &dy_per_dx_);
    load(rays_.dx_per_dy, &dx_per_dy_);
    ray_ = Lanes::Select(taken, Lanes::Rank(taken, rays_.next), ray_);
    adx_ = Lanes::Absolute(dx_);
    ady_ = Lanes::Absolute(dy_);
    back_x_ = Lanes::SignOf(dx_);
    back_y_ = Lanes::SignOf(dy_);
    ey_ = Lanes::template Left<16>(adx_);
    ex_ey_ = Lanes::Add(Lanes::template Left<16>(ady_), ey_);
    const V forth_x = Lanes::Or(back_x_, All(1)), forth_y = Lanes::Or(back_y_, All(1));
    to_next_y_ = Lanes::Add(Lanes::template Left<3>(forth_y), All(int64_t{1} << kFieldY));
    to_next_x_ = Lanes::Subtract(Lanes::Add(forth_x, All(int64_t{1} << kFieldX)), to_next_y_);
  }

  void SetStart(M taken) {
    const FanRecord& fan = rays_.fan;
    // From the other side of the cell: 65536 less the fraction.
    ox_ = Lanes::Add(Lanes::Xor(All(fan.fraction & 0xffff), back_x_),
                     Lanes::And(back_x_, All(65537)));
    oy_ = Lanes::Add(Lanes::Xor(All(fan.fraction >> 16), back_y_), Lanes::And(back_y_, All(65537)));
    const auto set = [&](V* lanes, int64_t number) {
      *lanes = Lanes::Select(taken, All(number), *lanes);
    };
    set(&u_, 0);
    set(&v_, 0);
    const int super_x = fan.x >> RAY_SUPER_SHIFT, super_y = fan.y >> RAY_SUPER_SHIFT;
    set(&super_x_, super_x);
    set(&super_y_, super_y);
    set(&super_, ray_find_super(&rays_.grid, super_x, super_y));
  }

  /// Finds the superregions of lanes that have left theirs.
  void FindSupers() {
    const V super_x = Lanes::template Right<RAY_SUPER_SHIFT>(x_);
    const V super_y = Lanes::template Right<RAY_SUPER_SHIFT>(y_);
    const M moved = Lanes::Or(Lanes::Differ(super_x, super_x_), Lanes::Differ(super_y, super_y_));
    if (!Lanes::Any(Lanes::And(active_, moved))) return;
    alignas(64) int64_t of_x[Lanes::kCount], of_y[Lanes::kCount], super[Lanes::kCount];
    Lanes::Store(of_x, super_x);
    Lanes::Store(of_y, super_y);
    for (int i = 0; i < Lanes::kCount; i++)
      super[i] = ray_find_super(&rays_.grid, static_cast<int>(of_x[i]), static_cast<int>(of_y[i]));
    super_ = Lanes::Load(super);
    super_x_ = super_x;
    super_y_ = super_y;
  }

  /// The words of the tiles, without what the window hides; 0 in lanes that are not to look.
  V Visible(M to_look, V x, V y) const {
    const ray_window_t& window = rays_.window;
    const V word = Lanes::Gather(to_look, rays_.grid.tiles, tile_);
    const V wx = Lanes::Subtract(Lanes::template Right<RAY_TILE_SHIFT>(x), All(window.x));
    const V wy = Lanes::Subtract(Lanes::template Right<RAY_TILE_SHIFT>(y), All(window.y));
    const M covered = Lanes::And(Lanes::And(to_look, Lanes::Below(wx, All(window.width))),
                                 Lanes::Below(wy, All(window.height)));
    if (!Lanes::Any(covered)) return word;
    const V index = Lanes::Add(Lanes::Multiply(wy, All(window.width)), wx);
    return Lanes::Without(word, Lanes::Gather(covered, window.tiles, index));
  }

  /// Sets u and v to where the leap lands that crosses the border to_x, if `in_x`, or to_y:
  /// ray_land(). A double tells that place to within one border.
  void Land(M in_x, V to_x, V to_y) {
    const V to = Lanes::Select(in_x, to_x, to_y);
    const V offset = Lanes::Select(in_x, ox_, oy_), other_offset = Lanes::Select(in_x, oy_, ox_);
    const V across = Lanes::Select(in_x, adx_, ady_), along = Lanes::Select(in_x, ady_, adx_);
    const V from = Lanes::Select(in_x, v_, u_);
    const D slope = Lanes::Select(in_x, dy_per_dx_, dx_per_dy_);
    const V at = Offset(to, offset), one = All(1);
    const V ties = Lanes::Select(in_x, one, All(0));
    const V target = Lanes::Add(Lanes::Multiply(at, along), ties);
    const V guess = Lanes::ToInteger(Lanes::Times(Lanes::ToDouble(at), slope));
    V n = Lanes::Larger(Lanes::template Right<16>(Lanes::Add(guess, other_offset)), from);
    const V ahead = Lanes::Multiply(Offset(Lanes::Add(n, one), other_offset), across);
    n = Lanes::AddWhere(Lanes::Greater(target, ahead), n, one);
    const V reached = Lanes::Multiply(Offset(n, other_offset), across);
    const M too_far = Lanes::AndNot(Lanes::Greater(n, from), Lanes::Greater(target, reached));
    n = Lanes::AddWhere(too_far, n, All(-1));
    u_ = Lanes::Select(in_x, to, n);
    v_ = Lanes::Select(in_x, n, to);
  }

  FanRays<Lanes>& rays_;
  M active_ = Lanes::None();

  // Of the ray.
  V ray_ = All(0);  // its number
  V dx_ = All(0), dy_ = All(0), adx_ = All(0), ady_ = All(0);
  V back_x_ = All(0), back_y_ = All(0);  // all ones if it goes that way
  V ox_ = All(0), oy_ = All(0), limit_x_ = All(0), limit_y_ = All(0);
  D dy_per_dx_ = Lanes::ToDouble(All(0)), dx_per_dy_ = Lanes::ToDouble(All(0));
  V ey_ = All(0), ex_ey_ = All(0);
  V to_next_y_ = All(0), to_next_x_ = All(0);  // a step in y, and what is added for one in x

  // Where it is, and what Look() found there.
  V u_ = All(0), v_ = All(0), x_ = All(0), y_ = All(0);
  V super_x_ = All(0), super_y_ = All(0), super_ = All(0);
  V tile_ = All(0), tile_map_ = All(0), word_ = All(0);
  M in_hit_ = Lanes::None();
};

/// Two groups in turn: while the numbers of one wait for memory, the other has something to do.
template <class Lanes>
void WalkInLanes(const WideRays& rays, WideHits* hits) {
  FanRays<Lanes> ready(rays, hits);
  LaneGroup<Lanes> first(&ready), second(&ready);
  first.TakeUp();
  second.TakeUp();
  first.Look();
  while (first.AtWork()) {
    second.Look();
    first.GoOn();
    first.Report();
    first.TakeUp();
    first.Look();
    second.GoOn();
    second.Report();
    second.TakeUp();
  }
  while (second.AtWork()) {
    second.Look();
    second.GoOn();
    second.Report();
  }
}

}  // namespace
}  // namespace Stg::internal::sensing

#endif
