// SPDX-License-Identifier: GPL-2.0-or-later
//
// The prefilter on an OpenCL device. The device keeps a copy of the grid's layers. Each step sends
// the changed tiles and one record per fan, and fetches the hit lists.

#ifndef STAGE_CL_CL_PREFILTER_HH
#define STAGE_CL_CL_PREFILTER_HH

#include <unistd.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libstage_cl/buffer.hh"
#include "libstage_cl/device_grid.hh"
#include "libstage_cl/open_device.hh"
#include "sensing/device_batch.hh"
#include "sensing/prefilter.hh"

namespace Stg::cl {

class ClPrefilter final : public sensing::Prefilter {
 public:
  /// Finds ranges if the device has the program for them, hits_per_ray is 1, and a test shows that
  /// they are those of the host; `tested` is a result of that test. Throws sensing::PrefilterError
  /// or cl::Error.
  ClPrefilter(std::shared_ptr<const OpenDevice> device, uint32_t hits_per_ray,
              std::optional<sensing::RangeModels> tested = {});

  sensing::RangeModels ranges() const override { return ranges_; }
  sensing::HitLists Walk(grid::Grid& grid, const sensing::DirectionTables& tables,
                         const sensing::RayBatch& batch, threads::WorkerPool* workers) override;
  std::size_t WaitFor(const sensing::RayBatch& batch, std::size_t fan) override;
  void SendAhead(grid::Grid& grid) override;
  std::unique_ptr<sensing::Prefilter> CloneForWorld() const override;
  bool UsesHost() const override { return is_cpu_; }
  bool IsForked() const override { return getpid() != process_; }
  std::string DeviceName() const override;
  const sensing::PrefilterStatistics& statistics() const override { return statistics_; }

 private:
  void CheckProcess() const;
  void WarmUp();
  void SendGrid(const grid::Grid& grid);
  void SendBatch(const sensing::RayBatch& batch, threads::WorkerPool* workers);
  void SendDirections(const sensing::DirectionTables& tables, const sensing::RayBatch& batch);
  void PrepareRanges();
  const uint32_t* EnqueueChunk(const grid::Grid& grid, const sensing::RayBatch& batch,
                               std::size_t chunk);
  void Enqueue(const grid::Grid& grid, const sensing::DeviceBatch::Launch& launch,
               ::cl::Event* done);
  /// Size of the lists of this many rays.
  std::size_t BytesOf(uint64_t rays) const {
    return static_cast<std::size_t>(rays) * (1 + per_ray_) * sizeof(uint32_t);
  }
  void Finish();
  void CountSent(std::size_t bytes) { statistics_.bytes_sent += bytes; }

  const std::shared_ptr<const OpenDevice> device_;  // destroyed last
  const pid_t process_ = getpid();
  const bool is_cpu_;
  const uint32_t per_ray_;
  sensing::PrefilterStatistics statistics_;

  ::cl::CommandQueue queue_;
  Memory memory_;
  ::cl::Kernel walk_, find_cell_ranges_, find_exact_ranges_;
  sensing::RangeModels ranges_;
  std::size_t work_group_ = 64;
  std::unique_ptr<DeviceGrid> grid_;
  bool sent_ahead_ = false;  // since the last batch
  sensing::DeviceBatch sorted_;
  Buffer batch_;  // output of sorted_.Write()
  Buffer directions_, unit_vectors_, hits_;
  // Per part of the batch: events for walked rays and fetched lists; null without rays.
  struct Progress {
    ::cl::Event walked, fetched;
  };
  std::vector<Progress> progress_;
  bool in_progress_ = false;         // the batch is not complete yet
  std::size_t directions_sent_ = 0;  // number of table directions sent, of generation_sent_
  uint64_t generation_sent_ = 0;
};

}  // namespace Stg::cl

#endif
