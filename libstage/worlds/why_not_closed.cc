// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/why_not_closed.hh"

#include "rows/row_bridge.hh"
#include "world/world.hh"
#include "worlds/world_pool.hh"

namespace Stg {

std::string WhyNotClosed(const World& world) {
  if (std::string reason = RowBridge::WhyNotClosed(world); !reason.empty()) return reason;
  WorldPool pool(world, {world.seed()});
  if (!pool.IsReady()) return "it cannot be copied";
  for (const uint32_t model : RowBridge::RunningModels(world)) pool.Subscribe(0, model);
  return pool.WhyNotClosed(0);
}

}  // namespace Stg
