// SPDX-License-Identifier: GPL-2.0-or-later
//
// The prefilter: walks all rays of a step at once and says where each may hit. It never decides:
// the predicate that is run on its answer does, on the host. This is the whole interface between
// the simulator and a device.

#ifndef STAGE_SENSING_PREFILTER_HH
#define STAGE_SENSING_PREFILTER_HH

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "grid/grid.hh"
#include "sensing/batch.hh"
#include "sensing/counters.hh"
#include "threads/worker_pool.hh"

namespace Stg::internal::sensing {

/// The first potential hits of each ray of a batch: 1 + per_ray words for each.
struct HitLists {
  const uint32_t* words = nullptr;
  uint32_t per_ray = 0;

  std::size_t WordsOf(std::size_t rays) const { return rays * (1 + per_ray); }
  /// Grid::OnlyBody() of the tile of the first hit, if there is a hit; or 0, and the host looks it
  /// up.
  uint32_t BodyOf(std::size_t ray) const { return words[WordsOf(ray)]; }
  /// per_ray hits, packed (ray_walk.h); RAY_NO_HIT ends a list early. A full list may go on: the
  /// host resumes behind its last.
  const uint32_t* ListOf(std::size_t ray) const { return words + WordsOf(ray) + 1; }
};

/// Thrown by a prefilter that can't go on; a plug-in that was let in (backend.hh) shares this type.
/// The run goes on without it, with the same results.
class PrefilterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Prefilter {
 public:
  virtual ~Prefilter() = default;

  /// Walks every fan of the batch that fits a device. The lists of other fans' rays are undefined.
  /// The result is valid until the next call. The grid's list of changes has been used up
  /// afterwards. The threads may help to get the batch ready. Throws PrefilterError.
  virtual HitLists Walk(grid::Grid& grid, const DirectionTables& tables, const RayBatch& batch,
                        threads::WorkerPool* workers) = 0;

  /// The lists may come part by part. Waits until those of the batch's fan number `fan`, and of all
  /// before it, are there. Returns how many fans have theirs, more than `fan`. The batch is the one
  /// that was walked last. Throws PrefilterError.
  virtual std::size_t WaitFor(const RayBatch& batch, std::size_t /*fan*/) {
    return batch.fans().size();
  }

  /// Sends the changes of the grid so far, if that helps: Walk() sends the rest. The grid must not
  /// change meanwhile, but may be read. Throws PrefilterError.
  virtual void SendAhead(grid::Grid&) {}

  /// One on the same device for another world, which may be stepped at the same time. What does not
  /// depend on a grid is shared: nothing is opened or compiled. Null: the device has to be opened
  /// once more.
  virtual std::unique_ptr<Prefilter> ForAnotherWorld() const { return nullptr; }

  /// This process has been forked: the driver's threads are not there, and who lets go of the
  /// device may wait for them without end. It has to be left as it is.
  virtual bool IsFromAnotherProcess() const { return false; }

  /// It walks on the host's own processors, which are not to be kept from it meanwhile.
  virtual bool UsesHost() const { return false; }

  /// Such as "gpu NVIDIA H200 (NVIDIA CUDA)".
  virtual std::string DeviceName() const = 0;
  virtual const PrefilterStatistics& statistics() const = 0;
};

}  // namespace Stg::internal::sensing

namespace Stg {
namespace sensing = internal::sensing;  // for the rooms above: clients see no such header
}

#endif
