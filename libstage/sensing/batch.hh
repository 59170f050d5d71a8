// SPDX-License-Identifier: GPL-2.0-or-later
//
// The batch of a step: the fans of all sensors that are due, in the order in which they came.

#ifndef STAGE_SENSING_BATCH_HH
#define STAGE_SENSING_BATCH_HH

#include <cstdint>
#include <span>
#include <vector>

#include "grid/grid.hh"
#include "sensing/fan.hh"
#include "sensing/fan_list.hh"

namespace Stg::internal::sensing {

/// Tiles of the grid whose marked cells hold nothing but one tree of models. Rays of that tree's
/// sensors, which never stop at their own tree, need not look at them.
struct SelfMask {
  int32_t x = 0, y = 0;  ///< tile coordinates of the first tile
  uint32_t width = 0, height = 0;
  uint32_t first = 0;  ///< index of its first word among the batch's
  uint32_t words() const { return width * height; }
};
/// A self-mask has at most this many tiles a side; larger bodies are looked at like any other.
inline constexpr uint32_t kMaxMaskSide = 16;

/// How much of a batch.
struct BatchShare {
  uint64_t rays = 0;
  uint32_t fans = 0;
  uint32_t words = 0;        ///< of self-masks
  uint32_t turned_fans = 0;  ///< those with directions of their own
  size_t turns = 0;          ///< these directions

  BatchShare& operator+=(const FanList::Entry& o) {
    rays += o.samples;
    fans++;
    turned_fans += o.turned;
    turns += o.turned ? o.samples : 0;
    return *this;
  }
  BatchShare& operator+=(const BatchShare& o) {
    rays += o.rays;
    fans += o.fans;
    words += o.words;
    turned_fans += o.turned_fans;
    turns += o.turns;
    return *this;
  }
};

/// What a device needs of a fan, on its own: that of all fans is read in one go.
struct DeviceFan {
  FanRecord record{};
  grid::LayerIndex layer = 0;
  bool fits = false;  ///< it is of a single leg and has rays, and is not left to the host
};

class RayBatch {
 public:
  void Clear();

  /// Adds a fan of `samples` rays. It is walked past the cells of the self-mask.
  void Add(Fan fan, uint32_t samples, const SelfMask& mask);

  /// The self-mask of a tree with these drawings: their cells in which there is nothing else.
  /// `tree` as in grid::Body; `exact`: which drawing of the bodies.
  SelfMask MakeSelfMask(const grid::Grid& grid, const grid::Drawings& own, const void* tree,
                        bool exact);

  // The same in parts, for many fans at once: first it is counted what comes, then room is made,
  // and then several threads fill it in.

  /// Appends room, all of which has to be filled; returns what was there before it.
  BatchShare AddRoom(const BatchShare& share);
  /// Puts a fan into its room. `first_ray`: of the batch.
  void Put(uint32_t index, Fan fan, uint64_t first_ray, uint32_t samples, const SelfMask& mask);
  /// The same with one of a list; its room begins at `first`.
  void Put(const BatchShare& first, const FanList& list, const FanList::Entry& entry,
           const SelfMask& mask);
  /// A self-mask around a body without its words, with `first` 0.
  static SelfMask PlanSelfMask(const grid::Drawings& own);
  void FillSelfMask(const SelfMask& mask, const grid::Grid& grid, const grid::Drawings& own,
                    const void* tree, bool exact);

  std::span<const Fan> fans() const { return {fans_.data(), fan_count_}; }
  /// For a layer that was not known when the fan was put in.
  void SetLayer(uint32_t index, grid::LayerIndex layer) {
    fans_[index].layer = device_fans_[index].layer = layer;
  }
  /// Leaves a fan to the host.
  void KeepFromDevice(uint32_t index) { device_fans_[index].fits = false; }
  std::span<const DeviceFan> device_fans() const { return {device_fans_.data(), fan_count_}; }
  uint64_t ray_count() const { return ray_count_; }
  /// Whether a device can tell the rays apart: it has 32 bits for their numbers.
  bool FitsDevice() const { return ray_count_ <= UINT32_MAX; }
  const std::vector<uint64_t>& mask_words() const { return mask_words_; }
  /// Directions of this step's noisy sensors. Their indices begin where those of the tables end.
  const std::vector<Direction>& own_directions() const { return own_directions_; }
  /// To be called once all fans are in.
  void Close(const DirectionTables& tables);

  const Direction* DirectionsOf(const Fan& fan) const;
  /// The same in doubles, for the exact ray model.
  const SineCosine* TurnsOf(const Fan& fan) const;
  ray_mask_t SelfMaskOf(const Fan& fan) const;

 private:
  std::vector<Fan> fans_;  // the first fan_count_: they are made once, and put in again and again
  std::vector<DeviceFan> device_fans_;
  uint32_t fan_count_ = 0;
  std::vector<uint64_t> mask_words_;
  std::vector<Direction> own_directions_;
  std::vector<SineCosine> own_turns_;
  std::vector<uint32_t> fans_with_own_directions_;
  const DirectionTables* tables_ = nullptr;
  uint64_t ray_count_ = 0;
};

}  // namespace Stg::internal::sensing

#endif
