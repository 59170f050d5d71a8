// SPDX-License-Identifier: GPL-2.0-or-later
//
// The prefilter on an OpenCL device. The device keeps a copy of the grid's layers; each step sends
// it the tiles that changed and one record for each fan, and fetches the hit lists.

#ifndef STAGE_CL_CL_PREFILTER_HH
#define STAGE_CL_CL_PREFILTER_HH

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "libstage_cl/buffer.hh"
#include "libstage_cl/device.hh"
#include "sensing/prefilter.hh"

namespace Stg::cl {

class ClPrefilter : public sensing::Prefilter {
 public:
  /// Throws sensing::PrefilterError or cl::Error.
  ClPrefilter(const FoundDevice& device, uint32_t hits_per_ray);

  sensing::HitLists Walk(grid::Grid& grid, const sensing::DirectionTables& tables,
                         const sensing::RayBatch& batch, sensing::WorkerPool* workers) override;
  void SendAhead(grid::Grid& grid) override;
  bool UsesHost() const override { return is_cpu_; }
  std::string DeviceName() const override { return name_; }
  const sensing::PrefilterStatistics& statistics() const override { return statistics_; }

 private:
  // The device's copy of one layer of the grid.
  struct Layer {
    explicit Layer(Memory* memory) : tile_maps(memory), tiles(memory) {}
    Buffer tile_maps, tiles;
    std::size_t regions = 0;  // copied
    uint64_t made = 0;        // of which incarnation of the layer
  };
  // Fans with the same number of samples in the same layer: one launch.
  struct Group {
    uint32_t layer, samples;
    uint32_t first_fan, fans;
  };
  static constexpr uint32_t kNoGroup = 0xffffffffu;
  // Fans that one thread puts into their groups.
  static constexpr std::size_t kBlock = 64;
  static std::size_t CountBlocks(std::size_t fans) { return (fans + kBlock - 1) / kBlock; }

  void SendGrid(const grid::Grid& grid);
  void SendStructure(const grid::Grid& grid);
  void SendLayer(const grid::Grid& grid, uint32_t index);
  void SendChanges(const grid::Occupancy& cells, Layer* layer);
  void SendFans(const sensing::RayBatch& batch, sensing::WorkerPool* workers);
  void SendDirections(const sensing::DirectionTables& tables, const sensing::RayBatch& batch);
  void MakeGroups(const sensing::RayBatch& batch, sensing::WorkerPool* workers);
  template <typename F>
  static void ForEachBlock(std::size_t fans, sensing::WorkerPool* workers, F f);
  bool CountGroups(std::span<const sensing::DeviceFan> fans, sensing::WorkerPool* workers);
  void FindGroups(std::span<const sensing::DeviceFan> fans);
  uint32_t GroupOf(const sensing::DeviceFan& fan, uint32_t likely) const;
  void Launch(const grid::Grid& grid, const Group& group);
  void Update(Buffer* target, const std::vector<uint32_t>& places,
              const std::vector<uint64_t>& words);
  void CountSent(std::size_t bytes) { statistics_.bytes_sent += bytes; }

  std::string name_;
  bool is_cpu_;
  uint32_t per_ray_;
  sensing::PrefilterStatistics statistics_;

  ::cl::Context context_;
  ::cl::CommandQueue queue_;
  Memory memory_;
  ::cl::Kernel walk_, update_;
  std::size_t work_group_ = 64;
  Buffer directory_, regions_;  // of superregions; of regions in them
  uint64_t structure_version_ = 0;
  bool sent_ahead_ = false;  // since the last batch
  std::vector<std::unique_ptr<Layer>> layers_;
  Buffer fans_, directions_, windows_, hits_;
  std::size_t directions_sent_ = 0;  // of the tables, of this generation
  uint64_t generation_sent_ = 0;
  Buffer places_, words_;  // of an update

  // Scratch, kept for its memory.
  std::vector<Group> groups_;  // some may have no fans in the last batch
  std::vector<uint32_t> group_of_fan_;
  std::vector<uint32_t> next_in_group_;  // by block and group: fans, then where the next one goes
  std::size_t fan_count_ = 0;            // in groups
  std::vector<uint32_t> tile_places_, map_places_;
  std::vector<uint64_t> tile_words_, map_words_;
};

}  // namespace Stg::cl

#endif
