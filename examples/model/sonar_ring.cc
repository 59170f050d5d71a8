// SPDX-License-Identifier: GPL-2.0-or-later
//
// A custom model type in a plug-in: a ring of sonars with conical beams. World files with `plugins
// "sonar_ring"` may contain models `sonar_ring( )`. See README.md.

#include "sonar_ring.hh"

#include <algorithm>

namespace {

constexpr int kMaxSonars = 1000;
constexpr std::size_t kRaysOfACone = 3;
constexpr double kWatts = 0.5;

/// Sound stops at everything that rangers see, except the robot that carries the ring.
bool StopsSound(Stg::Model* candidate, const Stg::Model* ring, const void*) {
  return !candidate->IsRelated(ring) && !(candidate->vis.ranger_return < 0);
}

/// Describes the sensor for `stage --explain`.
void Describe(const SonarRing& ring, Stg::SensorExtent* extent) {
  extent->parts = ring.ranges().size();
  extent->rays = extent->parts * kRaysOfACone;
}

// Registers the type when the plug-in is loaded.
[[maybe_unused]] const bool kRegistered =
    Stg::RegisterModelType(Stg::ModelTypeOf<SonarRing>("sonar_ring").Senses(Describe).Measurable());

}  // namespace

SonarRing::SonarRing(Stg::World* world_, Stg::Model* parent_, const std::string& type_)
    : Stg::Model(world_, parent_, type_), ranges_(8, reach_), cone_(kRaysOfACone) {
  ClearBlocks();  // no body unless the world file defines one
}

void SonarRing::Load() {
  if (!LoadCommon()) return;  // a callback has deleted the model
  const int count = wf->ReadInt(wf_entity, "count", static_cast<int>(ranges_.size()));
  if (count < 1 || count > kMaxSonars)
    wf->Fail(
        wf_entity, "count",
        "found " + std::to_string(count) + " sonars, expected 1 to " + std::to_string(kMaxSonars));
  reach_ = wf->ReadLength(wf_entity, "reach", reach_);
  if (!(reach_ > 0)) wf->Fail(wf_entity, "reach", "found a reach that is not positive");
  width_ = wf->ReadAngle(wf_entity, "width", width_);
  ranges_.assign(static_cast<std::size_t>(count), reach_);
}

void SonarRing::Startup() {
  Stg::Model::Startup();
  SetWatts(kWatts);
}

void SonarRing::Shutdown() {
  std::fill(ranges_.begin(), ranges_.end(), reach_);
  SetWatts(0);
  Stg::Model::Shutdown();
}

void SonarRing::Update() {
  Stg::Pose heading = GetGlobalPose();
  const double turn = 2 * M_PI / static_cast<double>(ranges_.size());
  for (double& range : ranges_) {
    world->Raytrace(heading, reach_, width_, StopsSound, this, nullptr, true, cone_);
    range = reach_;
    STAGE_ASSERT(cone_.size() == kRaysOfACone);
    for (const Stg::RaytraceResult& ray : cone_) range = std::min(range, ray.range);
    heading.a = Stg::normalize(heading.a + turn);
  }
  Stg::Model::Update();  // schedules the next update and calls the callbacks
}

void SonarRing::ExchangeState(Stg::StateExchange& exchange) {
  Stg::Model::ExchangeState(exchange);
  exchange(ranges_, reach_, width_);
}
