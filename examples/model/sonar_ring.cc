// SPDX-License-Identifier: GPL-2.0-or-later
//
// A custom model type in a plug-in: a ring of sonars with conical beams. World files with `plugins
// "sonar_ring"` may contain models `sonar_ring( )`. See README.md.

#include "sonar_ring.hh"

#include <algorithm>

namespace {

constexpr int kMaxSonars = 1000;
constexpr std::uint32_t kRaysOfACone = 3;
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

// Registers the type when the plug-in is loaded. Several rings may update at once, each of which
// casts rays through its own robot. NumPy arrays, logs and the browser page get the ranges.
[[maybe_unused]] const bool kRegistered = Stg::RegisterModelType(
    Stg::ModelTypeOf<SonarRing>("sonar_ring")
        .Updates(Stg::ModelType::kParallel | Stg::ModelType::kIgnoresOwnTree |
                 Stg::ModelType::kUsesEverythingLayer)
        .Senses(Describe)
        .Measurable()
        .Reads(Stg::MakeReading("ranges", "m",
                                "Distance to the nearest thing in each cone, or the reach. The "
                                "first cone looks ahead, the others follow counter-clockwise.",
                                &SonarRing::ranges)));

}  // namespace

SonarRing::SonarRing(Stg::World* world_, Stg::Model* parent_, const std::string& type_)
    : Stg::Model(world_, parent_, type_), ranges_(8, reach_) {
  ClearBlocks();  // no body unless the world file defines one
}

SonarRing::~SonarRing() { FinishRays(); }

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
  expects_hits_ = false;
  std::fill(ranges_.begin(), ranges_.end(), reach_);
  SetWatts(0);
  Stg::Model::Shutdown();
}

void SonarRing::Update() {
  // Where several models update at once, Stage calls Gather() and Model::Update() instead.
  GatherSerially();
  Stg::Model::Update();  // schedules the next update and calls the callbacks
}

/// Adds a fan of rays for each cone to the batch of the step.
void SonarRing::Gather(FanList* fans) {
  RayFan cone;
  cone.origin = GetGlobalPose();
  cone.range = reach_;
  cone.fov = width_;
  cone.rays = kRaysOfACone;
  cone.test = StopsSound;
  cone.sink = this;
  const double turn = 2 * M_PI / static_cast<double>(ranges_.size());
  for (; cone.tag < ranges_.size(); cone.tag++) {
    AddRays(fans, cone);
    cone.origin.a = Stg::normalize(cone.origin.a + turn);
  }
  expects_hits_ = true;
}

/// Called when the batch has been traced, by several threads for different sonars.
void SonarRing::ReceiveHits(std::uint32_t sonar, const RayHits& hits) {
  if (!expects_hits_ || sonar >= ranges_.size()) return;  // it has been shut down meanwhile
  ranges_[sonar] = *std::min_element(hits.ranges, hits.ranges + hits.count);
}

void SonarRing::ExchangeState(Stg::StateExchange& exchange) {
  Stg::Model::ExchangeState(exchange);
  exchange(ranges_, reach_, width_);
}
