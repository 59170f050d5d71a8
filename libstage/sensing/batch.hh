// SPDX-License-Identifier: GPL-2.0-or-later
//
// The batch of a step: the fans of all sensors that are due, in order of arrival.

#ifndef STAGE_SENSING_BATCH_HH
#define STAGE_SENSING_BATCH_HH

#include <cstdint>
#include <span>
#include <vector>

#include "grid/grid.hh"
#include "messages/assert.hh"
#include "sensing/fan.hh"
#include "sensing/fan_list.hh"

namespace Stg::internal::sensing {

/// Tiles whose marked cells hold nothing but one tree of models. Rays of that tree's sensors skip
/// these cells, because they never stop at their own tree. Behind the tiles is a word with the
/// layers in which the tree has unmarked cells that hold nothing else of that layer.
struct SelfMask {
  int32_t x = 0, y = 0;  ///< tile coordinates of the first tile
  uint32_t width = 0, height = 0;
  uint32_t first = 0;  ///< index of the first word in the batch's mask words
  uint32_t tiles() const { return width * height; }
  uint32_t words() const { return tiles() == 0 ? 0 : tiles() + 1; }
};
/// Maximum width and height of a self-mask, in tiles. Larger bodies get none.
inline constexpr uint32_t kMaxMaskSide = 16;

/// Element counts of a part of a batch, or the offsets at which that part begins.
struct BatchSpace {
  uint64_t rays = 0;
  uint32_t fans = 0;
  uint32_t words = 0;         ///< words of self-masks
  uint32_t custom_fans = 0;   ///< fans with their own directions
  size_t own_directions = 0;  ///< directions of these fans

  BatchSpace& operator+=(const FanList::Entry& o) {
    rays += o.samples;
    fans++;
    custom_fans += o.has_own_directions;
    own_directions += o.has_own_directions ? o.samples : 0;
    return *this;
  }
  BatchSpace& operator+=(const BatchSpace& o) {
    rays += o.rays;
    fans += o.fans;
    words += o.words;
    custom_fans += o.custom_fans;
    own_directions += o.own_directions;
    return *this;
  }
};

/// The data of a fan that a device needs, apart from Fan so that all of them are read in sequence.
struct DeviceFan {
  FanRecord record{};
  grid::LayerIndex layer = 0;
  bool fits = false;  ///< a device may walk it: it has rays and a single leg, and was not excluded
  bool exact = false;
  bool sees_all = false;    ///< see Fan::sees_all_but
  bool one_height = false;  ///< rays of one height, which pass above and below bodies
};

/// A device's result for each ray of a fan: potential hits, or the range in one of the ray models.
enum class DeviceResult : uint8_t { kHits, kCellRanges, kExactRanges };

/// The ray models whose ranges a device can find.
struct RangeModels {
  bool cell = false, exact = false;
};

class RayBatch {
 public:
  void Clear();

  /// Adds a fan of `samples` rays. The walk ignores the cells of the self-mask.
  void Add(Fan fan, uint32_t samples, const SelfMask& mask);

  /// Makes the self-mask of a tree of models: the cells of its rasterizations `own` that hold
  /// nothing else. `tree` is as in grid::Body; `exact` selects the kind of rasterization.
  SelfMask MakeSelfMask(const grid::Grid& grid, const grid::Rasterizations& own, const void* tree,
                        bool exact);

  // Parallel alternative to the above: count all elements, allocate them with Allocate(), then let
  // several threads fill them in.

  /// Allocates elements, all of which must then be filled in. Returns their offsets.
  BatchSpace Allocate(const BatchSpace& space);
  /// Stores a fan at `index`. `first_ray` is the index of its first ray in the batch.
  void Put(uint32_t index, Fan fan, uint64_t first_ray, uint32_t samples, const SelfMask& mask);
  /// Stores a fan of a list at the offsets `first`.
  void Put(const BatchSpace& first, const FanList& list, const FanList::Entry& entry,
           const SelfMask& mask);
  /// The position and size of a self-mask for these rasterizations, with `first` 0.
  static SelfMask SelfMaskBounds(const grid::Rasterizations& own);
  void FillSelfMask(const SelfMask& mask, const grid::Grid& grid, const grid::Rasterizations& own,
                    const void* tree, bool exact);

  std::span<const Fan> fans() const { return {fans_.data(), fan_count_}; }
  /// Sets the layer of a fan whose layer was still unknown when it was added.
  void SetLayer(uint32_t index, grid::LayerIndex layer) {
    STAGE_ASSERT(index < fan_count_ && fans_[index].layer == grid::kNoLayer);
    STAGE_ASSERT(layer < grid::kMaxLayers);
    fans_[index].layer = device_fans_[index].layer = layer;
  }
  /// Excludes a fan from the device, so that the host traces it.
  void ExcludeFromDevice(uint32_t index) {
    STAGE_ASSERT(index < fan_count_);
    device_fans_[index].fits = false;
  }
  std::span<const DeviceFan> device_fans() const { return {device_fans_.data(), fan_count_}; }
  /// Lets a device find the ranges of fans of these models.
  void AskForRanges(RangeModels models, const grid::Grid& grid) {
    asked_ = models;
    layers_of_all_heights_ = grid.LayersOfAllHeights();
    new_layers_ = grid.NewLayers();
  }
  /// The result that a device gives for the fan, if it fits. It cannot find ranges if bodies of the
  /// layer may be passed: bodies at other heights or, in the cell model, of the finder's own tree,
  /// which a self-mask must hide. Self-masks may be older than the newest layers.
  DeviceResult ResultOf(const DeviceFan& fan) const {
    const uint32_t layer = 1u << fan.layer;
    if (!fan.sees_all || (fan.one_height && (layers_of_all_heights_ & layer) != 0))
      return DeviceResult::kHits;
    if (fan.exact) return asked_.exact ? DeviceResult::kExactRanges : DeviceResult::kHits;
    return asked_.cell && fan.record.mask_size != 0 && (new_layers_ & layer) == 0
               ? DeviceResult::kCellRanges
               : DeviceResult::kHits;
  }
  uint64_t ray_count() const { return ray_count_; }
  /// True if a device can number the rays: it has 32 bits for that.
  bool FitsDevice() const { return ray_count_ <= UINT32_MAX; }
  const std::vector<uint64_t>& mask_words() const { return mask_words_; }
  /// Directions of this step's noisy sensors. Their indices start where those of the tables end.
  const std::vector<Direction>& own_directions() const { return own_directions_; }
  const std::vector<SineCosine>& own_unit_vectors() const { return own_unit_vectors_; }
  /// Call when all fans are in.
  void Close(const DirectionTables& tables);

  const Direction* DirectionsOf(const Fan& fan) const;
  /// Like DirectionsOf(), in doubles for the exact ray model.
  const SineCosine* UnitVectorsOf(const Fan& fan) const;
  ray_mask_t SelfMaskOf(const Fan& fan) const;

 private:
  std::vector<Fan> fans_;  // first fan_count_ are in use; the memory is reused
  std::vector<DeviceFan> device_fans_;
  uint32_t fan_count_ = 0;
  std::vector<uint64_t> mask_words_;
  std::vector<Direction> own_directions_;
  std::vector<SineCosine> own_unit_vectors_;
  std::vector<uint32_t> fans_with_own_directions_;
  const DirectionTables* tables_ = nullptr;
  uint64_t ray_count_ = 0;
  RangeModels asked_;
  uint32_t layers_of_all_heights_ = 0, new_layers_ = 0;
};

}  // namespace Stg::internal::sensing

#endif
