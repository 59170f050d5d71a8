// SPDX-License-Identifier: GPL-2.0-or-later
//
// Results of rays in the lanes of a vector: ranges, bodies, and intervals of rays with the same
// bodies. For rays that were walked here (wide_walk_lanes.hh) or by a device. The rules in
// wide_walk_lanes.hh for code that is compiled for particular processors apply here too.

#ifndef STAGE_SENSING_SIMD_WIDE_HITS_HH
#define STAGE_SENSING_SIMD_WIDE_HITS_HH

#include "grid/grid.hh"
#include "sensing/simd/wide_rays.hh"
#include "sensing/simd/wide_walk.hh"

namespace Stg::internal::sensing {
namespace {

/// Finds the ranges and bodies of hits.
template <class Lanes>
class HitPlaces {
 public:
  HitPlaces(const RayStarts<Lanes>& rays, const grid::Grid::Tables& tables)
      : rays_(rays), tables_(tables) {}

  /// Sets ranges and bodies of all rays.
  void Find(const SuperMap<Lanes>& supers, const WideHits& found) {
    for (first_ = 0; first_ < rays_.count; first_ += Lanes::kCount) {
      const HitPosition position = LoadHits(found.hits);
      PutRanges(position, found);
      Lanes::Store(cells_ + first_, Cells(supers, position));
    }
    for (first_ = 0; first_ < rays_.count; first_ += Lanes::kCount)
      FindBodies(found, LoadHits(found.hits).here, All(WideHits::kNothing));
  }

  /// Sets ranges of all rays, and bodies where they are unknown (0).
  void Complete(const RayGroup& rays, const WideHits& found) {
    uint32_t unknown = 0;  // number of vectors with unknown bodies
    for (first_ = 0; first_ < rays_.count; first_ += Lanes::kCount) {
      const HitPosition position = LoadHits(found.hits);
      PutRanges(position, found);
      const V bodies = Lanes::Select(position.here, Load(found.bodies), All(WideHits::kNothing));
      Lanes::Store(found.bodies + first_, bodies);
      firsts_[unknown] = first_;
      unknown += Lanes::Any(Unknown(bodies));
    }
    if (unknown == 0) return;
    const SuperMap<Lanes> supers = SupersNear<Lanes>(rays);
    for (uint32_t i = 0; i < unknown; i++) {
      first_ = firsts_[i];
      Lanes::Store(cells_ + first_, Cells(supers, LoadHits(found.hits)));
    }
    for (uint32_t i = 0; i < unknown; i++) {
      first_ = firsts_[i];
      active_ = Lanes::FirstOf(rays_.count - first_);
      const V bodies = Load(found.bodies);
      FindBodies(found, Unknown(bodies), bodies);
    }
  }

 private:
  using V = typename Lanes::V;
  using D = typename Lanes::D;
  using M = typename Lanes::M;

  static V All(int64_t number) { return Lanes::All(number); }
  template <typename Number>
  V Load(const Number* numbers) const {
    return Lanes::Load(numbers + first_);
  }

  struct HitPosition {
    M here;  // rays with a hit
    V u, v;  // position of the hit; 0 without one
  };
  /// Loads the hits of the rays from first_ on.
  HitPosition LoadHits(const uint32_t* hits) {
    active_ = Lanes::FirstOf(rays_.count - first_);
    const V hit = Load(hits);
    const M here = Lanes::And(active_, Lanes::Differ(hit, All(RAY_NO_HIT)));
    return {here, Lanes::Select(here, Lanes::And(hit, All(0xffff)), All(0)),
            Lanes::Select(here, Lanes::template Right<16>(hit), All(0))};
  }

  /// Active lanes whose body list is still unknown (0).
  M Unknown(V bodies) const { return Lanes::And(active_, Lanes::Equal(bodies, All(0))); }

  void PutRanges(const HitPosition& position, const WideHits& found) const {
    // Ranges of exact rays are computed elsewhere.
    const D end = Lanes::AllOf(1.0);
    const D middles =
        rays_.exact ? end : Lanes::Select(position.here, Middles(position.u, position.v), end);
    Lanes::Store(active_, found.ranges + first_,
                 Lanes::Times(middles, Lanes::Load(rays_.leg_lengths + first_)));
  }

  /// Looks up the bodies of cells_ in the lanes `wanted`; the other lanes get `others`.
  void FindBodies(const WideHits& found, M wanted, V others) const {
    const V bodies = Bodies(wanted, Lanes::Load(cells_ + first_));
    Lanes::Store(found.bodies + first_, Lanes::Select(wanted, bodies, others));
  }

  V Cells(const SuperMap<Lanes>& supers, const HitPosition& position) const {
    const V x = Reached<Lanes>(Load(rays_.x0), position.u, Lanes::SignOf(Load(rays_.dx)));
    const V y = Reached<Lanes>(Load(rays_.y0), position.v, Lanes::SignOf(Load(rays_.dy)));
    const V super = supers.Of(active_, x, y);
    const V tile = Lanes::Add(Lanes::template Left<6>(RegionOf<Lanes>(rays_.grid, super, x, y)),
                              TileInRegion<Lanes>(x, y));
    const V bit = Lanes::Or(Lanes::And(x, All(7)), Lanes::template Left<3>(Lanes::And(y, All(7))));
    return Lanes::Or(Lanes::template Left<6>(tile), bit);
  }

  V Bodies(M wanted, V cells) const {
    return rays_.exact ? Outlines(wanted, cells) : Lists(wanted, cells);
  }

  /// Grid::OutlinesIn() in lanes.
  V Outlines(M wanted, V cells) const {
    return Lanes::Gather(wanted, tables_.outlines, Lanes::template Right<6>(cells));
  }

  /// Grid::ListIn() in lanes.
  V Lists(M wanted, V cells) const {
    using Tile = grid::Grid::TileCells;
    constexpr int64_t kWords = sizeof(Tile) / sizeof(uint64_t), kHalves = 2 * kWords;
    static_assert(sizeof(Tile) == kWords * sizeof(uint64_t));
    const V slot = Lanes::template Right<6>(cells), bit = Lanes::And(cells, All(63));
    const V drawn =
        Lanes::Gather(wanted, &tables_.tiles->cells, Lanes::Multiply(slot, All(kWords)));
    const M occupied = Lanes::Odd(Lanes::BitOf(drawn, bit));
    const V bodies =
        Lanes::Gather(occupied, &tables_.tiles->bodies, Lanes::Multiply(slot, All(kHalves)));
    const M several = Lanes::Odd(Lanes::template Right<31>(bodies));
    if (!Lanes::Any(several)) return bodies;
    const V lists = Lanes::template Left<6>(Lanes::Without(bodies, All(grid::Grid::kListFlag)));
    const V list = Lanes::Gather(several, tables_.lists->data(), Lanes::Or(lists, bit));
    return Lanes::Select(several, list, bodies);
  }

  /// Bit-equal to MiddleOf() in middle.hh.
  D Middles(V u, V v) const {
    const V across = Lanes::Absolute(Load(rays_.dx)), along = Lanes::Absolute(Load(rays_.dy));
    const V in_x = Lanes::Subtract(Lanes::template Left<16>(u), Load(rays_.ox));
    const V in_y = Lanes::Subtract(Lanes::template Left<16>(v), Load(rays_.oy));
    const V cell = All(65536), out_x = Lanes::Add(in_x, cell), out_y = Lanes::Add(in_y, cell);
    const V none = All(0);
    const M only_x = Lanes::Equal(along, none), only_y = Lanes::Equal(across, none);
    const auto quotient = [&](M by_x, V x, V y) {
      const M in_lanes_of_x = Lanes::Or(only_x, Lanes::AndNot(by_x, only_y));
      return Lanes::Divide(Lanes::ToDouble(Lanes::Select(in_lanes_of_x, x, y)),
                           Lanes::ToDouble(Lanes::Select(in_lanes_of_x, across, along)));
    };
    // The larger and the smaller of two quotients, selected by their cross products.
    const D in = quotient(
        Lanes::Greater(Lanes::Multiply(in_x, along), Lanes::Multiply(in_y, across)), in_x, in_y);
    const D out =
        quotient(Lanes::Greater(Lanes::Multiply(out_y, across), Lanes::Multiply(out_x, along)),
                 out_x, out_y);
    const D zero = Lanes::AllOf(0.0), half = Lanes::AllOf(0.5);
    const D middle = Lanes::Times(
        half, Lanes::Plus(Lanes::Larger(in, zero), Lanes::Smaller(out, Lanes::AllOf(1.0))));
    return Lanes::Select(Lanes::And(only_x, only_y), half, middle);
  }

  const RayStarts<Lanes>& rays_;
  const grid::Grid::Tables& tables_;
  alignas(64) int64_t cells_[RayStarts<Lanes>::kCapacity];  // cells of the hits
  uint32_t firsts_[RayStarts<Lanes>::kCapacity / Lanes::kCount];
  M active_ = Lanes::None();
  uint32_t first_ = 0;
};

/// Finds the ends of intervals of rays with the same bodies.
template <class Lanes>
void FindEnds(uint32_t count, const WideHits& found) {
  static_assert(Lanes::kCount <= 8, "the padding behind the bodies is too small for a vector");
  for (uint32_t i = 0; i < WideHits::kEndWords; i++) found.ends[i] = 0;
  for (uint32_t first = 0; first < count; first += Lanes::kCount) {
    const uint64_t differ = Lanes::BitsOf(
        Lanes::Differ(Lanes::Load(found.bodies + first), Lanes::Load(found.bodies + first + 1)));
    found.ends[first / 64] |= differ << first % 64;
    if (first % 64 + Lanes::kCount > 64) found.ends[first / 64 + 1] |= differ >> (64 - first % 64);
  }
}

/// CopyDeviceHits() for lists of one hit. The last lanes may overwrite what follows.
template <class Lanes>
void CopyDeviceHitPairs(const FanSlice& slice, uint32_t* to_bodies, uint32_t* to_hits) {
  for (uint32_t done = 0; done < slice.count; done += Lanes::kCount) {
    typename Lanes::V bodies, hits;
    Lanes::LoadPairs(slice.walked + 2 * done, slice.count - done, &bodies, &hits);
    Lanes::Store(to_bodies + done, bodies);
    Lanes::Store(to_hits + done, hits);
  }
}

template <class Lanes>
void CopyAllDeviceHits(const RayGroup& rays, const WideHits& found) {
  uint32_t first = 0;
  for (uint32_t i = 0; i < rays.slice_count; i++) {
    const FanSlice& slice = rays.slices[i];
    uint32_t* const bodies = found.bodies + first;
    uint32_t* const hits = found.hits + first;
    if (rays.words_per_ray == 2)
      CopyDeviceHitPairs<Lanes>(slice, bodies, hits);
    else
      CopyDeviceHits(slice, rays.words_per_ray, bodies, hits);
    first += slice.count;
  }
  if (rays.exact) ClearBodies(rays.count, found.bodies);
}

template <class Lanes>
void EvaluateInLanes(const RayGroup& rays, const grid::Grid::Tables& tables,
                     const WideHits& found) {
  CopyAllDeviceHits<Lanes>(rays, found);
  const RayStarts<Lanes> starts(rays);
  HitPlaces<Lanes>(starts, tables).Complete(rays, found);
  FindEnds<Lanes>(rays.count, found);
}

}  // namespace
}  // namespace Stg::internal::sensing

#endif
