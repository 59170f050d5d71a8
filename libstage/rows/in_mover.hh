// SPDX-License-Identifier: GPL-2.0-or-later
//
// The models of a world that belong to movers, with their places among these.

#ifndef STAGE_ROWS_IN_MOVER_HH
#define STAGE_ROWS_IN_MOVER_HH

#include <cstdint>

#include "models/model.hh"
#include "rows/scene.hh"
#include "world/world.hh"

namespace Stg::rows {

/// Place of a model among the movers.
struct InMover {
  uint32_t mover, node;
};

/// Calls f(Model*, InMover) for the models of all movers, in the order of the nodes.
template <typename F>
void ForEachInMovers(const World& world, const Scene& scene, F f) {
  for (uint32_t k = 0; k < scene.movers.size(); k++) {
    uint32_t node = 0;
    const auto visit = [&](Model* model, const auto& self) -> void {
      f(model, InMover{k, node++});
      for (Model* child : model->GetChildren()) self(child, self);
    };
    visit(world.FindModel(scene.movers[k].model->GetId()), visit);
  }
}

}  // namespace Stg::rows

#endif
