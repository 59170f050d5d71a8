// SPDX-License-Identifier: GPL-2.0-or-later
//
// Helpers for tests of World::Raytrace: boxes, and rays that stop at all models.

#ifndef STAGE_TESTS_RAYTRACE_TESTING_HH
#define STAGE_TESTS_RAYTRACE_TESTING_HH

#include <limits>

#include "support/model_testing.hh"

namespace Stg {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline bool Any(Model*, const Model*, const void*) { return true; }

inline Model* AddBox(World* world, const Size& size, const Pose& pose) {
  Model* model = world->CreateModel(nullptr, "model");
  model->SetGeom(Geom(Pose(), size));
  model->SetPose(pose);
  return model;
}

inline RaytraceResult Look(World* world, const Pose& from, double range) {
  return world->Raytrace(from, range, Any, nullptr, nullptr, true);
}

}  // namespace Stg

#endif
