// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays whose first listed cell decides what they hit, as that of most does: neither a walk nor its
// preparation is needed. This is what is left to the host of nearly all rays that a device has
// walked.
//
// What takes time is memory, so it is first said, for several rays, what will be looked at, and
// then looked at; and the arithmetic of several rays goes side by side.

#ifndef STAGE_SENSING_FIRST_LISTED_HH
#define STAGE_SENSING_FIRST_LISTED_HH

#include "grid/grid.hh"
#include "sensing/fan.hh"

namespace Stg::internal::sensing {

class FirstListed {
 public:
  static constexpr uint32_t kAtOnce = 16;

  /// A fan of a single leg, in the cell model.
  FirstListed(const grid::Grid& grid, const Fan& fan)
      : grid_(grid),
        fan_(fan),
        fraction_x_(static_cast<int>(fan.record.fraction & 0xffff)),
        fraction_y_(static_cast<int>(fan.record.fraction >> 16)) {}

  /// Looks at up to kAtOnce rays. The list of ray i begins at lists[i * per_ray].
  void Look(const Direction* directions, const uint32_t* lists, uint32_t per_ray, uint32_t count);

  /// The list of ray i of them is empty.
  bool HitsNothing(uint32_t i) const { return !listed_[i]; }
  /// Its first cell.
  grid::CellRef Cell(uint32_t i) const { return cells_[i]; }
  /// Where along its leg the ray is halfway through that cell: the very bits of MiddleOf().
  double Middle(uint32_t i) const { return middle_[i]; }

 private:
  void Locate(uint32_t i, const Direction& direction, uint32_t hit);
  grid::CellRef CellAt(int32_t x, int32_t y);
  void SetPassage(uint32_t i, double in_x, double in_y, double across, double along);
  void FindMiddles(uint32_t count);

  const grid::Grid& grid_;
  const Fan& fan_;
  const int fraction_x_, fraction_y_;
  int32_t tile_x_ = 0, tile_y_ = 0;  // that was looked for last
  uint32_t slot_ = 0;                // and where it is; 0: none yet

  bool listed_[kAtOnce];
  grid::CellRef cells_[kAtOnce];
  // Of the passage through the cell: see Passage in tracer.cc.
  alignas(16) double in_x_[kAtOnce], in_y_[kAtOnce], across_[kAtOnce], along_[kAtOnce];
  alignas(16) double middle_[kAtOnce];
};

}  // namespace Stg::internal::sensing

#endif
