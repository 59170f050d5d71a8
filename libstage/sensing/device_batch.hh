// SPDX-License-Identifier: GPL-2.0-or-later
//
// Prepares a batch for any device: sorts its fans into groups that are alike for the kernel, and
// writes all records into one buffer, laid out as kernels/records.h defines.

#ifndef STAGE_SENSING_DEVICE_BATCH_HH
#define STAGE_SENSING_DEVICE_BATCH_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "grid/grid.hh"
#include "kernels/records.h"
#include "sensing/batch.hh"
#include "threads/worker_pool.hh"

namespace Stg::internal::sensing {

class DeviceBatch {
 public:
  /// Groups that one kernel launch walks. There is one work-item per ray; the items of each group
  /// are padded to whole work-groups.
  struct Launch {
    std::size_t first_group, end_group, items;
    std::size_t chunk;
    DeviceResult result;  // of all its fans
  };
  /// An interval of fans in the batch. Each part is walked and delivered before the next one.
  struct Chunk {
    std::size_t first_fan, end_fan;
  };
  /// Offsets of a layer in the device's copy of the grid, in words.
  struct LayerPlace {
    uint32_t region_maps, tile_maps, tiles;
  };

  /// Sorts the fans that a device can walk. Call it first.
  void Sort(const RayBatch& batch, threads::WorkerPool* workers);
  /// Layers that these fans use, without duplicates.
  const std::vector<grid::LayerIndex>& layers() const { return layers_; }

  /// True if a fan has results of this kind.
  bool Has(DeviceResult result) const;

  /// Plans the launches; call it after Sort(). `shares` are the cumulative fractions of fans at the
  /// end of each part; the last one is 1. Each part gets as few launches as 32-bit ray numbers
  /// allow, or one per group.
  void PlanLaunches(std::span<const double> shares, std::size_t work_group, bool one_for_each_group,
                    const std::function<LayerPlace(grid::LayerIndex)>& place_of);
  const std::vector<Chunk>& chunks() const { return chunks_; }
  /// Launches, ordered by part.
  const std::vector<Launch>& launches() const { return launches_; }

  /// Size in bytes of what Write() writes: group records, fan records, records for ranges if they
  /// are asked for, self-masks.
  std::size_t bytes() const { return masks_at() + mask_words_ * sizeof(uint64_t); }
  /// Number of records between the record of a fan and its record for ranges.
  uint32_t to_range_record() const { return static_cast<uint32_t>(fan_count_); }
  /// Index of the first self-mask word, counted in words from the start of the buffer.
  uint32_t first_mask() const { return static_cast<uint32_t>(masks_at() / sizeof(uint64_t)); }
  /// Writes the records of the batch given to Sort(). `memory` must be aligned to 16 bytes.
  void Write(const RayBatch& batch, void* memory, threads::WorkerPool* workers);

 private:
  // Fans with the same number of samples in the same layer, and results of one kind.
  struct Group {
    grid::LayerIndex layer;
    DeviceResult result;
    uint32_t samples, first_fan, fans;
  };

  void PlanParts(std::span<const double> shares);
  void PlanGroup(std::size_t group, std::size_t chunk, std::size_t work_group,
                 bool one_for_each_group, LayerPlace place);
  uint32_t FirstOfGroup(std::size_t group, std::size_t fan) const;

  bool CountGroups(const RayBatch& batch, threads::WorkerPool* workers);
  void FindGroups(const RayBatch& batch);
  uint32_t GroupOf(const DeviceFan& fan, DeviceResult result, uint32_t likely) const;
  void NameLayers();
  // Index of the first fan record: the group records occupy the space of the records before it.
  std::size_t first_fan_record() const {
    return (groups_.size() * chunks_.size() * sizeof(ray_group_record_t) + sizeof(FanRecord) - 1) /
           sizeof(FanRecord);
  }
  std::size_t masks_at() const {
    static_assert(sizeof(FanRecord) == sizeof(ray_range_record_t));
    return (first_fan_record() + (has_ranges_ ? 2 : 1) * fan_count_) * sizeof(FanRecord);
  }

  // Reused buffers.
  std::vector<Group> groups_;  // some may be empty in this batch
  std::vector<uint32_t> group_of_fan_;
  std::vector<uint32_t> counts_or_next_;  // by block and group: number of fans, then next index
  std::size_t fan_count_ = 0;             // fans in groups
  bool has_ranges_ = false;               // a fan's result is ranges
  std::size_t mask_words_ = 0;
  std::vector<ray_group_record_t> group_records_;
  std::vector<Chunk> chunks_;
  std::vector<Launch> launches_;
  std::vector<grid::LayerIndex> layers_;
};

}  // namespace Stg::internal::sensing

#endif
