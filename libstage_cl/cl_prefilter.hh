// SPDX-License-Identifier: GPL-2.0-or-later
//
// The prefilter on an OpenCL device. The device keeps a copy of the grid's layers; each step sends
// it the tiles that changed and one record for each fan, and fetches the hit lists.

#ifndef STAGE_CL_CL_PREFILTER_HH
#define STAGE_CL_CL_PREFILTER_HH

#include <unistd.h>

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "libstage_cl/buffer.hh"
#include "libstage_cl/device.hh"
#include "libstage_cl/device_grid.hh"
#include "libstage_cl/driver_watch.hh"
#include "sensing/prefilter.hh"

namespace Stg::cl {

class ClPrefilter final : public sensing::Prefilter {
 public:
  /// Throws sensing::PrefilterError or cl::Error.
  ClPrefilter(const FoundDevice& device, uint32_t hits_per_ray);

  sensing::HitLists Walk(grid::Grid& grid, const sensing::DirectionTables& tables,
                         const sensing::RayBatch& batch, threads::WorkerPool* workers) override;
  void SendAhead(grid::Grid& grid) override;
  bool UsesHost() const override { return is_cpu_; }
  std::string DeviceName() const override { return name_; }
  const sensing::PrefilterStatistics& statistics() const override { return statistics_; }

  /// The driver is watched as long as the prefilter lives.
  void KeepWatch(std::unique_ptr<DriverWatch> watch) { watch_ = std::move(watch); }

 private:
  // Fans with the same number of samples in the same layer.
  struct Group {
    uint32_t layer, samples;
    uint32_t first_fan, fans;
  };
  // What the kernel reads of it. A launch walks some groups, whose items follow each other.
  struct GroupRecord {
    uint32_t first_item = 0, fans = 0, samples = 0, first_fan = 0;
    uint32_t tile_maps = 0, tiles = 0, unused[2] = {0, 0};
  };
  static_assert(sizeof(GroupRecord) == 32, "the kernel reads two int4");
  static constexpr uint32_t kNoGroup = 0xffffffffu;
  // Fans that one thread puts into their groups.
  static constexpr std::size_t kBlock = 64;
  static std::size_t CountBlocks(std::size_t fans) { return (fans + kBlock - 1) / kBlock; }

  void CheckProcess() const;
  void WarmUp();
  void SendGrid(const grid::Grid& grid);
  void SendBatch(const sensing::RayBatch& batch, threads::WorkerPool* workers);
  void SendDirections(const sensing::DirectionTables& tables, const sensing::RayBatch& batch);
  void MakeGroups(const sensing::RayBatch& batch, threads::WorkerPool* workers);
  template <typename F>
  static void ForEachBlock(std::size_t fans, threads::WorkerPool* workers, F f);
  bool CountGroups(std::span<const sensing::DeviceFan> fans, threads::WorkerPool* workers);
  void FindGroups(std::span<const sensing::DeviceFan> fans);
  uint32_t GroupOf(const sensing::DeviceFan& fan, uint32_t likely) const;
  struct Launch {
    std::size_t first_group, end_group, items;
  };
  void PlanLaunches();
  /// In bytes of batch_.
  std::size_t WindowsAt() const {
    return groups_.size() * sizeof(GroupRecord) + fan_count_ * sizeof(sensing::FanRecord);
  }
  void Enqueue(const grid::Grid& grid, const Launch& launch, ::cl::Event* done);
  void CountSent(std::size_t bytes) { statistics_.bytes_sent += bytes; }

  std::unique_ptr<DriverWatch> watch_;  // the last to go
  const pid_t process_ = getpid();
  std::string name_, platform_;
  bool is_cpu_;
  uint32_t per_ray_;
  sensing::PrefilterStatistics statistics_;

  ::cl::Context context_;
  ::cl::CommandQueue queue_;
  Memory memory_;
  ::cl::Kernel walk_;
  std::size_t work_group_ = 64;
  std::unique_ptr<DeviceGrid> grid_;
  bool sent_ahead_ = false;  // since the last batch
  Buffer batch_;             // group records, fan records, windows
  Buffer directions_, hits_;
  std::size_t directions_sent_ = 0;  // of the tables, of this generation
  uint64_t generation_sent_ = 0;

  // Scratch, kept for its memory.
  std::vector<Group> groups_;  // some may have no fans in the last batch
  std::vector<uint32_t> group_of_fan_;
  std::vector<uint32_t> next_in_group_;  // by block and group: fans, then where the next one goes
  std::size_t fan_count_ = 0;            // in groups
  std::vector<GroupRecord> group_records_;
  std::vector<Launch> launches_;
  std::vector<grid::LayerIndex> wanted_;  // layers
};

}  // namespace Stg::cl

#endif
