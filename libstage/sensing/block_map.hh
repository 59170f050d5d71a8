// SPDX-License-Identifier: GPL-2.0-or-later
//
// Region maps of the blocks around a robot, for the lanes of a vector. The rules in
// wide_walk_lanes.hh for code that is compiled for particular processors apply here too.

#ifndef STAGE_SENSING_BLOCK_MAP_HH
#define STAGE_SENSING_BLOCK_MAP_HH

#include "sensing/simd/wide_rays.hh"

namespace Stg::internal::sensing {
namespace {

/// Looks up region maps of blocks. The maps near one place are loaded once for all rays.
template <class Lanes>
class BlockMap {
 public:
  using V = typename Lanes::V;
  using M = typename Lanes::M;
  using Words = typename Lanes::Words;

  /// `supers` must be near the same place and outlive this object.
  BlockMap(const ray_grid_t& grid, const SuperMap<Lanes>& supers, int32_t x, int32_t y)
      : maps_(grid.region_maps), supers_(supers), near_(x, y) {}

  /// Region maps of the cells in `lanes`, whose superregions are known; other lanes are undefined.
  Words Of(M lanes, V super, V x, V y) {
    if (!is_filled_) Fill();
    const V block_x = Lanes::template Right<RAY_BLOCK_SHIFT>(x);
    const V block_y = Lanes::template Right<RAY_BLOCK_SHIFT>(y);
    V numbers;
    if (near_.Find(lanes, block_x, block_y, &numbers)) return Lanes::LookUp16(low_, high_, numbers);
    const V row = Lanes::template Left<1>(Lanes::And(block_y, Lanes::All(1)));
    const V place = Lanes::Or(row, Lanes::And(block_x, Lanes::All(1)));
    return Lanes::Gather(lanes, maps_, Lanes::Or(Lanes::template Left<2>(super), place));
  }

 private:
  /// Deferred until the first use, because short rays never need it.
  void Fill() {
    is_filled_ = true;
    for (int i = 0; i < near_.kCount; i++) {
      const int block_x = near_.XOf(i), block_y = near_.YOf(i);
      const uint32_t super = supers_.At(block_x >> 1, block_y >> 1);
      const uint64_t map = maps_[ray_block_map(super, block_x, block_y)];
      low_[i] = static_cast<int32_t>(map & 0xffffffff);
      high_[i] = static_cast<int32_t>(map >> 32);
    }
  }

  const uint64_t* const maps_;
  const SuperMap<Lanes>& supers_;
  const SquaresNear<Lanes, RAY_BLOCK_SHIFT> near_;
  bool is_filled_ = false;
  alignas(64) int32_t low_[SquaresNear<Lanes, RAY_BLOCK_SHIFT>::kCount];
  alignas(64) int32_t high_[SquaresNear<Lanes, RAY_BLOCK_SHIFT>::kCount];
};

}  // namespace
}  // namespace Stg::internal::sensing

#endif
