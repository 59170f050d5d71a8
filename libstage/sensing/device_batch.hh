// SPDX-License-Identifier: GPL-2.0-or-later
//
// A batch as a device gets it, whatever the device: its fans sorted into groups that look alike to
// the kernel, and one piece of memory with the records of all, laid out as kernels/records.h says.

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
  /// Groups that are walked together. Their items follow each other, one for each ray, each group's
  /// rounded up to whole work-groups.
  struct Launch {
    std::size_t first_group, end_group, items;
    std::size_t part;
  };
  /// Fans that are next to each other in the batch, which are walked, and told of, before those of
  /// the next part.
  struct Part {
    std::size_t first_fan, end_fan;
  };
  /// Where a layer begins in the device's copy of the grid.
  struct LayerPlace {
    uint32_t region_maps, tile_maps, tiles;
  };

  /// Sorts the fans that a device can walk. First of all.
  void Sort(const RayBatch& batch, threads::WorkerPool* workers);
  /// Those that the fans look through, each named once.
  const std::vector<grid::LayerIndex>& layers() const { return layers_; }

  /// `shares`: of all fans, how many are in a part or before it, the last one 1. As few launches
  /// for each part as there are numbers for rays, or one for each group. Secondly.
  void PlanLaunches(std::span<const double> shares, std::size_t work_group, bool one_for_each_group,
                    const std::function<LayerPlace(grid::LayerIndex)>& place_of);
  const std::vector<Part>& parts() const { return parts_; }
  /// Part after part.
  const std::vector<Launch>& launches() const { return launches_; }

  /// What Write() writes: group records; fan records, whose places are counted from the beginning,
  /// too; self-masks.
  std::size_t bytes() const { return masks_at() + mask_words_ * sizeof(uint64_t); }
  /// Of the first self-mask, in words of it.
  uint32_t first_mask() const { return static_cast<uint32_t>(masks_at() / sizeof(uint64_t)); }
  /// The same batch as before. `memory` is aligned to 16 bytes.
  void Write(const RayBatch& batch, void* memory, threads::WorkerPool* workers);

 private:
  // Fans with the same number of samples in the same layer.
  struct Group {
    grid::LayerIndex layer;
    uint32_t samples, first_fan, fans;
  };

  void PlanParts(std::span<const double> shares);
  void PlanGroup(std::size_t group, std::size_t part, std::size_t work_group,
                 bool one_for_each_group, LayerPlace place);
  uint32_t FirstOfGroup(std::size_t group, std::size_t fan) const;

  bool CountGroups(std::span<const DeviceFan> fans, threads::WorkerPool* workers);
  void FindGroups(std::span<const DeviceFan> fans);
  uint32_t GroupOf(const DeviceFan& fan, uint32_t likely) const;
  void NameLayers();
  // Of fan records, among them those that would fit into the room of the groups' records.
  std::size_t first_fan_record() const {
    return (groups_.size() * parts_.size() * sizeof(ray_group_record_t) + sizeof(FanRecord) - 1) /
           sizeof(FanRecord);
  }
  std::size_t masks_at() const { return (first_fan_record() + fan_count_) * sizeof(FanRecord); }

  // Scratch, kept for its memory.
  std::vector<Group> groups_;  // some may have no fans in this batch
  std::vector<uint32_t> group_of_fan_;
  std::vector<uint32_t> next_in_group_;  // by block and group: fans, then where the next one goes
  std::size_t fan_count_ = 0;            // in groups
  std::size_t mask_words_ = 0;
  std::vector<ray_group_record_t> group_records_;
  std::vector<Part> parts_;
  std::vector<Launch> launches_;
  std::vector<grid::LayerIndex> layers_;
};

}  // namespace Stg::internal::sensing

#endif
