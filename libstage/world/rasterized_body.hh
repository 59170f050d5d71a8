// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_WORLD_RASTERIZED_BODY_HH
#define STAGE_WORLD_RASTERIZED_BODY_HH

#include <cstdint>

#include "models/block.hh"
#include "models/state_exchange.hh"
#include "world/world.hh"

namespace Stg {

/// A rasterized body, other than those for the exact ray model.
struct World::RasterizedBody {
  uint32_t model = 0, number = 0;  // index of the model, and of the body within it
  Block* block = nullptr;
  uint64_t stamp = 0;
  bool is_recent = false;

  void ExchangeState(StateExchange& exchange) { exchange(model, number); }
  bool IsBefore(const RasterizedBody& o) const {
    return model != o.model ? model < o.model : number < o.number;
  }
};

}  // namespace Stg

#endif
