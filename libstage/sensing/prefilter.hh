// SPDX-License-Identifier: GPL-2.0-or-later
//
// The prefilter walks all rays of a step and finds where each may hit; the host runs the predicates
// on its results. For rays of rangers with the stock predicate it may find the ranges instead. This
// is the whole interface between simulator and device.

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

/// The first potential hits of each ray of a batch, 1 + per_ray words per ray; or, if RayBatch has
/// asked for them and per_ray is 1, ranges in the same place.
struct HitLists {
  const uint32_t* words = nullptr;
  uint32_t per_ray = 0;

  std::size_t WordsOf(std::size_t rays) const { return rays * (1 + per_ray); }
  /// Grid::OnlyBody() of the tile of the first hit, or 0 if the host must look it up. Undefined if
  /// there is no hit.
  uint32_t BodyOf(std::size_t ray) const { return words[WordsOf(ray)]; }
  /// per_ray hits, packed as by ray_pack(). RAY_NO_HIT ends a list early; after a full list the
  /// host resumes behind its last hit.
  const uint32_t* ListOf(std::size_t ray) const { return words + WordsOf(ray) + 1; }
  /// The ranges of a fan from its first ray on, as in DeviceRanges.
  const double* RangesOf(std::size_t first_ray) const {
    return static_cast<const double*>(static_cast<const void*>(words + WordsOf(first_ray)));
  }
};

/// Thrown by a prefilter that cannot continue; plug-ins share this type. The run continues without
/// the device, with the same results.
class PrefilterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Prefilter {
 public:
  virtual ~Prefilter() = default;

  /// The ray models whose ranges it can find, bit-equal to those of the host. Only with lists of
  /// one hit.
  virtual RangeModels ranges() const { return {}; }

  /// Walks every fan of the batch that fits a device, and finds what RayBatch::ResultOf() asks for.
  /// Results of other fans are undefined. The result is valid until the next call. Resets the
  /// grid's changes. Throws PrefilterError.
  virtual HitLists Walk(grid::Grid& grid, const DirectionTables& tables, const RayBatch& batch,
                        threads::WorkerPool* workers) = 0;

  /// Waits for the lists, which may arrive in parts, of fans 0 .. `fan` of the batch walked last.
  /// Returns the number of fans whose lists have arrived, more than `fan`. Throws PrefilterError.
  virtual std::size_t WaitFor(const RayBatch& batch, std::size_t /*fan*/) {
    return batch.fans().size();
  }

  /// Sends the changes of the grid so far, if that helps; Walk() sends the rest. The grid may be
  /// read but not changed meanwhile. Throws PrefilterError.
  virtual void SendAhead(grid::Grid&) {}

  /// A prefilter on the same device for another world, which may run on another thread. Shares what
  /// does not depend on a grid, so nothing is opened or compiled again. Null if unsupported.
  virtual std::unique_ptr<Prefilter> CloneForWorld() const { return nullptr; }

  /// True in a forked process: the driver's threads do not exist here, and releasing the device
  /// could wait for them forever. The prefilter must be leaked.
  virtual bool IsForked() const { return false; }

  /// True if the device is the host's CPU, whose cores must then be left to it.
  virtual bool UsesHost() const { return false; }

  /// For example "gpu NVIDIA H200 (NVIDIA CUDA)".
  virtual std::string DeviceName() const = 0;
  virtual const PrefilterStatistics& statistics() const = 0;
};

}  // namespace Stg::internal::sensing

namespace Stg {
namespace sensing = internal::sensing;  // for internal modules: clients do not see this header
}

#endif
