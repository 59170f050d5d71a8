// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tracks what a device's copy of the exact outlines lacks, as DeviceLayers does for the layers. The
// copy is one buffer of 64-bit words in three parts, each with spare capacity; the last two are
// laid out as kernels/records.h defines:
//   the first outline of each tile, two per word with the even slot in the lower half;
//   bodies, by BodyId;
//   outlines, by their numbers in the lists of tiles.

#ifndef STAGE_SENSING_DEVICE_OUTLINES_HH
#define STAGE_SENSING_DEVICE_OUTLINES_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "kernels/records.h"
#include "threads/worker_pool.hh"

namespace Stg::internal::sensing {

class DeviceOutlines {
 public:
  /// Edges of a body that its record has room for.
  static constexpr uint32_t kMaxEdges = RAY_BODY_EDGES;

  /// Allocates offsets for what the grid has. Call it first.
  void Allocate(const grid::Grid& grid);
  /// Required size of the buffer in words.
  std::size_t words() const { return first_outline() + outlines_ * RAY_OUTLINE_WORDS; }
  /// Offsets in words.
  std::size_t first_body() const { return regions_ * kPairs; }
  std::size_t first_outline() const { return first_body() + bodies_ * RAY_BODY_WORDS; }
  /// Call when the buffer was reallocated: its content is lost.
  void Invalidate() { is_valid_ = false; }

  /// True if all words must be sent, else only changes.
  bool NeedsFullCopy(const grid::Grid& grid) const {
    return !is_valid_ || version_ != grid.OutlinesVersion();
  }
  /// Writes all words() of the grid. Resets the changes of outlines.
  void WriteAll(const grid::Grid& grid, uint64_t* words, threads::WorkerPool* workers);
  /// Finds changes and returns the number of changed words. Resets the changes of outlines.
  std::size_t FindChanges(const grid::Grid& grid, threads::WorkerPool* workers);
  /// Writes the values and offsets of the words that were found.
  void WriteChanges(uint64_t* values, uint32_t* places) const;

 private:
  static constexpr std::size_t kPairs = grid::kTilesPerRegion / 2;  // words of a region
  struct Change {
    uint64_t value;
    uint32_t place;
  };
  struct alignas(64) Found {  // aligned, because each thread writes to its own all the time
    std::vector<Change> changes;
  };
  struct Changed {
    std::size_t index;  // of a pair of tiles or, behind these, of a body
    uint32_t tiles;     // which of the pair
  };
  template <typename Put>
  void PutBody(const grid::Grid& grid, grid::BodyId id, Put put) const;
  template <typename Put>
  void PutOutlines(const grid::Grid& grid, uint32_t slot, Put put) const;
  template <typename Put>
  void PutChanged(const grid::Grid& grid, std::size_t entry, Put put) const;
  static uint64_t FirstOutlines(const grid::Grid& grid, std::size_t pair);
  void ListChanged(const grid::Grid& grid);

  std::size_t regions_ = 0, bodies_ = 0, outlines_ = 0;  // capacities
  bool is_valid_ = false;
  uint64_t version_ = 0;          // Grid::OutlinesVersion() of the copy
  std::vector<Changed> changed_;  // pairs of tiles, then bodies
  std::size_t changed_pairs_ = 0;
  std::vector<Found> found_;  // by thread
};

}  // namespace Stg::internal::sensing

#endif
