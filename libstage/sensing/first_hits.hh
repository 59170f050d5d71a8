// SPDX-License-Identifier: GPL-2.0-or-later
//
// The first potential hits of a fan's rays: cells in which something is. Nearly always the bodies
// in there decide what the ray hits, so that nothing else is to be known of it.
//
// What takes time is memory, so it is first said, for several rays, what will be looked at, and
// then looked at; and the arithmetic of several rays goes side by side.

#ifndef STAGE_SENSING_FIRST_HITS_HH
#define STAGE_SENSING_FIRST_HITS_HH

#include "grid/grid.hh"
#include "sensing/fan.hh"
#include "sensing/wide_walk.hh"

namespace Stg::internal::sensing {

class FirstHits {
 public:
  static constexpr uint32_t kAtOnce = WideRays::kMost;

  /// A fan of a single leg, in the cell model.
  FirstHits(const grid::Grid& grid, const Fan& fan)
      : grid_(grid),
        fan_(fan),
        fraction_x_(static_cast<int>(fan.record.fraction & 0xffff)),
        fraction_y_(static_cast<int>(fan.record.fraction >> 16)) {}

  /// Takes up to kAtOnce rays. A device has walked them: the list of ray i begins at
  /// lists[i * per_ray].
  void Look(const Direction* directions, const uint32_t* lists, uint32_t per_ray, uint32_t count);
  /// The same; walks them itself.
  void Walk(const Direction* directions, const ray_grid_t& view, const ray_window_t& window,
            uint32_t count);

  /// There is nothing in the way of ray i of them.
  bool HitsNothing(uint32_t i) const { return hits_[i] == RAY_NO_HIT; }
  /// Its first potential hit, as lists have it, and the cell of that.
  const uint32_t& Packed(uint32_t i) const { return hits_[i]; }
  grid::CellRef Cell(uint32_t i) const { return cells_[i]; }
  /// Where along its leg the ray is halfway through that cell: the very bits of MiddleOf().
  double Middle(uint32_t i) const { return middle_[i]; }

 private:
  struct Step {
    int dx, dy;  // Q16 cells
  };
  void WalkSideBySide(WideWalk walk, const WideRays& rays);
  void WalkOneByOne(const Direction* directions, const ray_grid_t& view,
                    const ray_window_t& window, uint32_t count);
  Step StepTo(const Direction& direction) const;
  void Locate(uint32_t i, Step step);
  grid::CellRef CellAt(int32_t x, int32_t y);
  void SetPassage(uint32_t i, Step step);
  void SetNoPassage(uint32_t i);
  void FindMiddles(uint32_t count);
  void PrefetchBodies(uint32_t count) const;

  const grid::Grid& grid_;
  const Fan& fan_;
  const int fraction_x_, fraction_y_;
  int32_t tile_x_ = 0, tile_y_ = 0;  // that was looked for last
  uint32_t slot_ = 0;                // and where it is; 0: none yet

  uint32_t hits_[kAtOnce];
  grid::CellRef cells_[kAtOnce];
  // Of the passage through the cell: see Passage in tracer.cc.
  alignas(16) double in_x_[kAtOnce], in_y_[kAtOnce], across_[kAtOnce], along_[kAtOnce];
  alignas(16) double middle_[kAtOnce];
};

}  // namespace Stg::internal::sensing

#endif
