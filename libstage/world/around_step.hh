// SPDX-License-Identifier: GPL-2.0-or-later
//
// A call for World::CallAfterStep() that is also made before the step.

#ifndef STAGE_WORLD_AROUND_STEP_HH
#define STAGE_WORLD_AROUND_STEP_HH

#include <functional>

namespace Stg {

class World;

/// An argument of World::CallAfterStep(): `before` is called immediately before the next step, when
/// all commands for it have been given, and `after` after it. Neither may delete the world.
struct AroundStep {
  std::function<void(World&)> before, after;

  void operator()(World& world) const { after(world); }
};

}  // namespace Stg

#endif
