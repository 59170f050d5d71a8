// SPDX-License-Identifier: GPL-2.0-or-later
//
// Numbers of properties that differ between worlds of a pool with the same scene.

#include <cstddef>
#include <vector>

#include "messages/assert.hh"
#include "rows/row_bridge.hh"
#include "worlds/pool_access.hh"
#include "worlds/pool_impl.hh"

namespace Stg {

/// Gives a World object that has just been loaded the numbers of its world.
void WorldPool::Impl::VaryWorld(uint32_t id) {
  const Slot& slot = slots[id];
  if (!slot.values.empty() && slot.world)
    RowBridge::Vary(slot.scene()->varied(), slot.values, slot.world.get());
}

/// Brings the World object to the state after loading with its seed. Returns false if there is
/// none, or if it must be made again.
bool WorldPool::Impl::Restart(uint32_t id) {
  const Slot& slot = slots[id];
  const InitialState* const initial = slot.world ? slot.scene()->initial_state() : nullptr;
  if (!initial || !slot.world.get()->RestartFrom(*initial, seeds[id])) return false;
  VaryWorld(id);
  return true;
}

void PoolAccess::Reset(WorldPool& pool, const std::vector<uint32_t>& ids,
                       const std::vector<uint64_t>& seeds, const std::vector<uint32_t>& variants,
                       const double* values, size_t most) {
  pool.impl_->SetVariants(ids, variants);
  for (size_t i = 0; i < ids.size(); i++) SetValues(pool, ids[i], values + i * most, most);
  pool.Reset(ids, seeds);
}

void PoolAccess::SetValues(WorldPool& pool, uint32_t id, const double* values, size_t most) {
  WorldPool::Impl::Slot& slot = pool.impl_->slots[id];
  const size_t count = slot.scene()->varied().size();
  STAGE_ASSERT(count <= most);
  slot.values.assign(values, values + count);
}

const std::vector<double>& PoolAccess::Values(const WorldPool& pool, uint32_t id) {
  return pool.impl_->slots[id].values;
}

}  // namespace Stg
