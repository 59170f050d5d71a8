// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays from arbitrary poses in a row. See RayCaster.

#include <algorithm>
#include <cmath>

#include "rows/meet.hh"
#include "rows/stepper.hh"
#include "sensing/fan.hh"

namespace Stg::rows {

namespace sensing = internal::sensing;

namespace {

bool StopsCastAtAll(Model* candidate, const Model*, const void*) {
  return !(candidate->vis.ranger_return < 0);
}

bool StopsCastOfMap(Model* candidate, const Model*, const void*) {
  return StopsCastAtAll(candidate, nullptr, nullptr) && !candidate->Root()->Drives();
}

/// The bodies of movers that rays at this height may hit.
std::vector<uint32_t> BodiesFor(const Scene& scene, const sensing::Fan& fan) {
  std::vector<uint32_t> bodies;
  for (uint32_t i = 0; i < scene.bodies.size(); i++) {
    const Body& body = scene.bodies[i];
    const bool passes = fan.z_test && (fan.z < body.height.min || fan.z > body.height.max);
    if (!passes && fan.predicate(const_cast<Model*>(body.model), nullptr, nullptr))
      bodies.push_back(i);
  }
  return bodies;
}

}  // namespace

void Rows::Stepper::Cast(const Casting& casting, std::span<const Planar> poses,
                         const uint32_t* ignored, double* ranges) {
  const auto count = static_cast<uint32_t>(casting.directions.size());
  if (s_.looks.size() < count) s_.looks.resize(count);
  sensing::Fan fan;
  fan.predicate = casting.robots ? StopsCastAtAll : StopsCastOfMap;
  fan.z_test = !std::isnan(casting.z);
  const double z = fan.z_test ? casting.z : 0;
  fan.layer = 0;  // everything, of which the predicate chooses
  fan.z = z;
  const std::vector<uint32_t> bodies = BodiesFor(scene_, fan);
  const RaysOfSensor rays{casting.directions.data(), casting.unit_vectors.data()};
  for (size_t i = 0; i < poses.size(); i++) {
    sensing::PlaceFan(&fan, Pose(poses[i].x, poses[i].y, z, poses[i].a), casting.range,
                      scene_.cells_per_metre);
    STAGE_ASSERT(fan.legs <= 1);
    std::fill_n(s_.looks.begin(), count, Look{fan.range, kNowhere, 0, nullptr});
    if (!fan.nothing) {
      TraceStanding(fan, rays, count);
      for (const uint32_t body : bodies)
        if (scene_.bodies[body].mover != ignored[i]) LookAtMover(fan, rays, count, body);
    }
    for (uint32_t k = 0; k < count; k++) *ranges++ = s_.looks[k].range;
  }
}

bool Rows::CanCast(const Scene& scene, RayModel model, double range) {
  return !scene.prototype->IsExact(model) && range * scene.cells_per_metre <= RAY_LEG_CELLS;
}

void Rows::Cast(size_t world, const Casting& casting, std::span<const Planar> poses,
                const uint32_t* ignored, double* ranges, Scratch* scratch) {
  Stepper(this, world, scratch).Cast(casting, poses, ignored, ranges);
}

}  // namespace Stg::rows
