// SPDX-License-Identifier: GPL-2.0-or-later
//
// The worlds of a pool that are copies of the same prototype: their scene, and their rows.

#ifndef STAGE_WORLDS_POOL_VARIANT_HH
#define STAGE_WORLDS_POOL_VARIANT_HH

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "rows/rows.hh"
#include "worlds/pool_device.hh"
#include "worlds/pool_scene.hh"

namespace Stg {

class PoolVariant {
 public:
  PoolVariant(std::shared_ptr<PoolScene> of, uint32_t with_number, PoolDevice* device)
      : scene(std::move(of)), number(with_number), device_(device) {}

  /// Gives a world a place, which is the number of its row. As long as worlds are only taken away
  /// in reverse order, places are in the order of the worlds. Call Grow() before a place is used.
  uint32_t AddWorld();
  void RemoveWorld(uint32_t place);
  /// Gives rows as many places as worlds have.
  void Grow();

  /// The rows of worlds with these subscriptions; null if such worlds are not closed. Several
  /// threads may call it at once.
  rows::Rows* RowsOf(Subscriptions* subscriptions);
  /// True if there are several, of which some may be unused.
  bool HasSeveralRows() const;
  /// Frees rows whose number was not in `used` for a number of calls. Returns whether others that
  /// are unused remain.
  bool FreeRows(const std::array<bool, Subscriptions::kMost>& used);
  void FreeAllRows();

  const std::shared_ptr<PoolScene> scene;
  const uint32_t number;

 private:
  static constexpr int kMostCallsWithoutUse = 20;
  void Free(size_t i);

  PoolDevice* const device_;
  uint32_t places_ = 0;
  std::vector<uint32_t> free_;
  // By the number of their subscriptions.
  std::mutex making_rows_;
  std::array<std::unique_ptr<rows::Rows>, Subscriptions::kMost> owned_rows_;
  std::array<std::atomic<rows::Rows*>, Subscriptions::kMost> rows_{};
  std::array<int, Subscriptions::kMost> calls_without_use_{};
};

}  // namespace Stg

#endif
