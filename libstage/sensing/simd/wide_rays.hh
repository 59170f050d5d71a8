// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays in the lanes of a vector, and their places in the grid: the common part of the walk
// (wide_walk_lanes.hh) and its evaluation (wide_hits.hh). The rules in wide_walk_lanes.hh for code
// that is compiled for particular processors apply here too.

#ifndef STAGE_SENSING_SIMD_WIDE_RAYS_HH
#define STAGE_SENSING_SIMD_WIDE_RAYS_HH

#include "grid/grid.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {
namespace {

/// ray_find_super() for several superregions, given by their coordinates. Mostly the first probe of
/// the hash table succeeds in all lanes.
template <class Lanes>
typename Lanes::V FindSupers(const ray_grid_t& grid, typename Lanes::V x, typename Lanes::V y) {
  using V = typename Lanes::V;
  const V product = Lanes::Xor(Lanes::Multiply(x, Lanes::All(int32_t(RAY_HASH_X))),
                               Lanes::Multiply(y, Lanes::All(int32_t(RAY_HASH_Y))));
  const V low = Lanes::LowHalf(product);
  const V above = Lanes::And(Lanes::template Right<RAY_HASH_SHIFT>(low),
                             Lanes::All((1 << (32 - RAY_HASH_SHIFT)) - 1));
  const V hash = Lanes::Xor(low, above);
  const ray_super_t& first = *grid.directory;
  constexpr int kWords = sizeof first / sizeof first.index;
  const V slot = Lanes::Multiply(
      Lanes::And(hash, Lanes::All(static_cast<typename Lanes::Number>(grid.directory_mask))),
      Lanes::All(kWords));
  const V index = Lanes::Gather(&first.index, slot);
  const auto others = Lanes::Or(Lanes::Differ(x, Lanes::Gather(&first.x, slot)),
                                Lanes::Differ(y, Lanes::Gather(&first.y, slot)));
  if (!Lanes::Any(Lanes::And(others, Lanes::Differ(index, Lanes::All(0))))) return index;

  using Number = typename Lanes::Number;
  alignas(64) Number of_x[Lanes::kCount], of_y[Lanes::kCount], super[Lanes::kCount];
  Lanes::Store(of_x, x);
  Lanes::Store(of_y, y);
  for (int i = 0; i < Lanes::kCount; i++)
    super[i] = static_cast<Number>(
        ray_find_super(&grid, static_cast<int>(of_x[i]), static_cast<int>(of_y[i])));
  return Lanes::Load(super);
}

/// The 4 x 4 squares of 2^kShift cells around a cell. They extend at least one and a half squares
/// from the cell to each side.
template <class Lanes, int kShift>
class SquaresNear {
 public:
  using V = typename Lanes::V;

  SquaresNear(int32_t x, int32_t y) : x_(First(x)), y_(First(y)) {}

  static constexpr int kCount = 16;
  /// Coordinates of square i, in squares.
  int XOf(int i) const { return x_ + i % kSide; }
  int YOf(int i) const { return y_ + i / kSide; }
  /// Index of a square.
  int NumberOf(int x, int y) const { return x - x_ + (y - y_) * kSide; }

  /// Sets *numbers to the indices of the squares. Returns false if one in `lanes` is not near.
  bool Find(typename Lanes::M lanes, V x, V y, V* numbers) const {
    const V i = Lanes::Subtract(x, Lanes::All(x_));
    const V k = Lanes::Subtract(y, Lanes::All(y_));
    *numbers = Lanes::Or(i, Lanes::template Left<2>(k));
    const V far = Lanes::template Right<2>(Lanes::Or(i, k));
    return !Lanes::Any(Lanes::And(lanes, Lanes::Differ(far, Lanes::All(0))));
  }

 private:
  static constexpr int kSide = 4;
  static int32_t First(int32_t cell) { return ((cell >> (kShift - 1)) - 3) >> 1; }

  const int32_t x_, y_;
};

/// Looks up superregions. Those near one place are found without the directory.
template <class Lanes>
class SuperMap {
 public:
  using V = typename Lanes::V;

  SuperMap(const ray_grid_t& grid, int32_t x, int32_t y) : grid_(grid), near_(x, y) {
    for (int i = 0; i < near_.kCount; i++)
      supers_[i] = static_cast<Number>(ray_find_super(&grid, near_.XOf(i), near_.YOf(i)));
  }
  /// Converts a map to other lanes.
  template <class Others>
  SuperMap(const SuperMap<Others>& same, int32_t x, int32_t y) : grid_(same.grid()), near_(x, y) {
    for (int i = 0; i < near_.kCount; i++)
      supers_[i] = static_cast<Number>(same.At(near_.XOf(i), near_.YOf(i)));
  }
  const ray_grid_t& grid() const { return grid_; }

  /// The superregions of the cells in `lanes`. Other lanes are unspecified.
  V Of(typename Lanes::M lanes, V x, V y) const {
    const V super_x = Lanes::template Right<RAY_SUPER_SHIFT>(x);
    const V super_y = Lanes::template Right<RAY_SUPER_SHIFT>(y);
    V numbers;
    if (!near_.Find(lanes, super_x, super_y, &numbers))
      return FindSupers<Lanes>(grid_, super_x, super_y);
    return Lanes::LookUp16(supers_, numbers);
  }
  /// A superregion near the place.
  uint32_t At(int super_x, int super_y) const {
    return static_cast<uint32_t>(supers_[near_.NumberOf(super_x, super_y)]);
  }

 private:
  using Number = typename Lanes::Number;

  const ray_grid_t& grid_;
  const SquaresNear<Lanes, RAY_SUPER_SHIFT> near_;
  alignas(64) Number supers_[SquaresNear<Lanes, RAY_SUPER_SHIFT>::kCount];
};

/// The superregions near the group.
template <class Lanes>
SuperMap<Lanes> SupersNear(const RayGroup& rays) {
  return {*rays.grid, rays.slices[0].fan->x, rays.slices[0].fan->y};
}
template <class Lanes, class Others>
SuperMap<Lanes> SupersNear(const RayGroup& rays, const SuperMap<Others>& same) {
  return {same, rays.slices[0].fan->x, rays.slices[0].fan->y};
}

/// Displacements of a fan's rays: one per lane, at most `count`.
template <class Lanes>
void Displace(const FanRecord& fan, const Direction* directions, uint32_t count,
              typename Lanes::V* dx, typename Lanes::V* dy) {
  using V = typename Lanes::V;
  V cosines, sines;
  Lanes::LoadPairs(directions, count, &cosines, &sines);
  const V cosine = Lanes::All(fan.cosine), sine = Lanes::All(fan.sine);
  const V half = Lanes::All(int64_t{1} << 29);
  const V x = Lanes::Subtract(Lanes::Multiply(cosine, cosines), Lanes::Multiply(sine, sines));
  const V y = Lanes::Add(Lanes::Multiply(sine, cosines), Lanes::Multiply(cosine, sines));
  *dx = Lanes::template Right<30>(Lanes::Add(x, half));
  *dy = Lanes::template Right<30>(Lanes::Add(y, half));
}

/// Offset of the start in its cell, in the direction of travel.
template <class Lanes>
typename Lanes::V OffsetOf(int64_t fraction, typename Lanes::V displacement) {
  return Lanes::Select(Lanes::Greater(Lanes::All(0), displacement), Lanes::All(65536 - fraction),
                       Lanes::All(fraction));
}

/// Starts and displacements of a group's rays.
template <class Lanes>
class RayStarts {
 public:
  using V = typename Lanes::V;
  using M = typename Lanes::M;

  explicit RayStarts(const RayGroup& rays)
      : grid(*rays.grid), count(rays.count), exact(rays.exact) {
    uint32_t first = 0;
    for (uint32_t i = 0; i < rays.slice_count; i++) {
      const FanSlice& slice = rays.slices[i];
      // The last lanes may write into the next slice, which is written later, or into the padding.
      for (uint32_t done = 0; done < slice.count; done += Lanes::kCount)
        Prepare(slice, done, first + done);
      first += slice.count;
    }
  }

  /// Capacity, padded because rays are prepared a whole vector at a time.
  static constexpr uint32_t kCapacity = RayGroup::kMaxRays + 16;
  static_assert(Lanes::kCount <= 16);

  const ray_grid_t& grid;
  const uint32_t count;
  const bool exact;

  alignas(64) int32_t x0[kCapacity], y0[kCapacity];
  alignas(64) int32_t dx[kCapacity], dy[kCapacity];
  alignas(64) int32_t ox[kCapacity], oy[kCapacity];
  alignas(64) double leg_lengths[kCapacity];

 private:
  static V All(int64_t number) { return Lanes::All(number); }

  /// Prepares a vector of the slice's rays, from `done` on.
  void Prepare(const FanSlice& slice, uint32_t done, uint32_t first) {
    const FanRecord& fan = *slice.fan;
    V to_x, to_y;
    Displace<Lanes>(fan, slice.directions + done, slice.count - done, &to_x, &to_y);
    Lanes::Store(leg_lengths + first, Lanes::AllOf(slice.leg_length));
    Lanes::Store(dx + first, to_x);
    Lanes::Store(dy + first, to_y);
    Lanes::Store(x0 + first, All(fan.x));
    Lanes::Store(y0 + first, All(fan.y));
    Lanes::Store(ox + first, OffsetOf<Lanes>(fan.fraction & 0xffff, to_x));
    Lanes::Store(oy + first, OffsetOf<Lanes>(fan.fraction >> 16, to_y));
  }
};

/// The coordinate `borders` borders from the start. `back`: all ones where the ray travels
/// backwards.
template <class Lanes>
typename Lanes::V Reached(typename Lanes::V start, typename Lanes::V borders,
                          typename Lanes::V back) {
  return Lanes::Add(start, Lanes::Subtract(Lanes::Xor(borders, back), back));
}

/// The regions of cells, given their superregions.
template <class Lanes>
typename Lanes::V RegionOf(const ray_grid_t& grid, typename Lanes::V super, typename Lanes::V x,
                           typename Lanes::V y) {
  const auto row = Lanes::And(Lanes::template Right<2>(y), Lanes::All(0xf0));
  const auto column = Lanes::And(Lanes::template Right<6>(x), Lanes::All(0x0f));
  return Lanes::Gather(grid.regions,
                       Lanes::Add(Lanes::template Left<8>(super), Lanes::Or(row, column)));
}

/// Index of a cell's tile in its region.
template <class Lanes>
typename Lanes::V TileInRegion(typename Lanes::V x, typename Lanes::V y) {
  const auto row = Lanes::And(y, Lanes::All(0x38));
  return Lanes::Or(row, Lanes::And(Lanes::template Right<3>(x), Lanes::All(7)));
}

}  // namespace
}  // namespace Stg::internal::sensing

#endif
