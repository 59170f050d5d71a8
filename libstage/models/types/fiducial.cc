// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/fiducial.hh"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "models/host.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/types/detections.hh"
#include "models/types/fiducial_index.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

/// All bodies block the view except the finder's own tree.
bool StopsFinder(Model* candidate, const Model* finder, const void*) {
  return !candidate->IsRelated(finder);
}

void Describe(const ModelFiducial&, SensorExtent* extent) { extent->rays_vary = true; }

const std::vector<ModelFiducial::Fiducial>& Seen(const ModelFiducial& finder) {
  return finder.GetFiducials();
}

ReadingShape ShapeOfCount(const ModelFiducial&) { return ReadingShape(); }
bool CopyCount(const ModelFiducial& finder, size_t, int32_t* to) {
  *to = static_cast<int32_t>(Seen(finder).size());
  return true;
}

}  // namespace

ModelType FiducialType() {
  return ModelTypeOf<ModelFiducial>("fiducial")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel | ModelType::kIgnoresOwnTree | ModelType::kReadsFiducialIndex |
               ModelType::kUsesEverythingLayer)
      .Senses(Describe)
      .Measurable()
      .Reads(
          MakeReading("count", "", "Number of fiducials that are seen.", ShapeOfCount, CopyCount))
      .Reads(MakeListReading("id", "",
                             "The fiducial_return of each fiducial, in the order of creation; 0 "
                             "if it is too far away to be read.",
                             Seen, detections::PutId))
      .Reads(MakeListReading("range", "m", "From the origin of the finder to that of the fiducial.",
                             Seen, detections::PutRange))
      .Reads(MakeListReading("bearing", "rad", "Direction relative to the finder's heading.", Seen,
                             detections::PutBearing))
      .Reads(MakeListReading("heading", "rad",
                             "Heading of the fiducial relative to the finder's heading.", Seen,
                             detections::PutHeading));
}

ModelFiducial::ModelFiducial(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      max_range_anon(8.0),
      max_range_id(5.0),
      min_range(0.0),
      fov(M_PI),
      heading(0.0),
      key(0),
      ignore_zloc(false) {
  ClearBlocks();
  geom.Zero();
}

ModelFiducial::~ModelFiducial() {
  host().FinishRaysOf(this);
  host().fiducials->RemoveFinder(this);
}

void ModelFiducial::Load() {
  if (!LoadCommon()) return;
  min_range = wf->ReadLength(wf_entity, "range_min", min_range);
  max_range_anon = wf->ReadLength(wf_entity, "range_max", max_range_anon);
  max_range_id = wf->ReadLength(wf_entity, "range_max_id", max_range_id);
  fov = wf->ReadAngle(wf_entity, "fov", fov);
  const std::pair<const char*, double> kNotNegative[] = {{"range_min", min_range},
                                                         {"range_max", max_range_anon},
                                                         {"range_max_id", max_range_id},
                                                         {"fov", fov}};
  for (const auto& [name, value] : kNotNegative) CheckNotNegative(*wf, wf_entity, name, value);
  if (min_range > max_range_anon)
    wf->Fail(wf_entity, wf->PropertyExists(wf_entity, "range_min") ? "range_min" : "range_max",
             "found a range_min above range_max, expected one up to it");
  WarnIfEqual(wf, wf_entity, "range_max", min_range, max_range_anon,
              "it reports all targets at that range");
  ignore_zloc = wf->ReadInt(wf_entity, "ignore_zloc", ignore_zloc);
}

void ModelFiducial::Startup() {
  host().fiducials->AddFinder(this);
  Model::Startup();
}

void ModelFiducial::Shutdown() {
  fiducials_.clear();
  candidates_.clear();
  host().fiducials->RemoveFinder(this);
  Model::Shutdown();
}

ModelFiducial::Fiducial* ModelFiducial::GetFiducials(unsigned int* count) {
  if (count) *count = static_cast<unsigned int>(fiducials_.size());
  return fiducials_.data();
}

void ModelFiducial::Update() {
  if (subs == 0) return;
  host().fiducials->Refresh(host().models);
  GatherSerially();
  Model::Update();
}

void ModelFiducial::Gather(sensing::FanList* fans) {
  CollectCandidates();
  if (candidates_.empty())
    fiducials_.clear();
  else
    AddFan(fans);
}

void ModelFiducial::CollectCandidates() {
  const FiducialIndex& index = *host().fiducials;
  candidates_.clear();
  const Pose own = GetGlobalPose();
  Fiducial candidate;
  for (const uint32_t i : index.Near(own.x, own.y, max_range_anon)) {
    const FiducialIndex::Target& target = index.target(i);
    if (MakeCandidate(own, target.model, target.pose, &candidate)) candidates_.push_back(candidate);
  }
}

/// Tests all conditions except the line of sight. Returns false if the target cannot be found.
bool ModelFiducial::MakeCandidate(const Pose& own, Model* target, const Pose& there,
                                  Fiducial* candidate) const {
  if (target->vis.fiducial_key != vis.fiducial_key) return false;
  const double dx = there.x - own.x, dy = there.y - own.y;
  const double distance = std::sqrt(dx * dx + dy * dy);
  if (!(distance < max_range_anon)) return false;
  const double bearing = normalize(ArcTangent(dy, dx) - own.a);
  if (!(std::fabs(bearing) <= fov / 2.0)) return false;
  if (target->vis.fiducial_return == 0 || IsRelated(target)) return false;

  const Size size = target->GetGeom().size;
  candidate->range = std::max(distance, min_range);
  candidate->bearing = bearing;
  candidate->geom = Pose(size.x, size.y, size.z, normalize(there.a - own.a));
  candidate->pose = there;
  candidate->mod = target;
  candidate->id = distance < max_range_id ? target->vis.fiducial_return : 0;
  return true;
}

/// Adds one fan with a ray to each candidate. Rays have the full range, so they extend beyond the
/// candidate's origin.
void ModelFiducial::AddFan(sensing::FanList* fans) {
  sensing::Fan fan;
  fan.predicate = StopsFinder;
  fan.finder = this;
  fan.sink = this;
  PlaceFan(&fan, GetGlobalPose() + geom.pose, max_range_anon, RayModel::kDefault);
  static thread_local std::vector<double> bearings;  // static to reuse its memory
  bearings.clear();
  for (const Fiducial& candidate : candidates_) bearings.push_back(candidate.bearing);
  fans->Add(fan, bearings);
}

void ModelFiducial::ReceiveHits(uint32_t, const sensing::RayHits& hits) {
  if (candidates_.size() != hits.count) return;  // the finder lost its subscribers meanwhile
  fiducials_.clear();
  const sensing::HitInterval* hit_interval = hits.intervals;
  for (uint32_t i = 0; i < hits.count; i++) {
    if (i == hit_interval->end) hit_interval++;
    STAGE_ASSERT(i < hit_interval->end && hit_interval->end <= hits.count);
    const Fiducial& candidate = candidates_[i];
    if (!candidate.mod) continue;
    const Model* hit = hit_interval->model;
    if (hit == candidate.mod || (!hit && ignore_zloc)) fiducials_.push_back(candidate);
  }
  candidates_.clear();
}

void ModelFiducial::Fiducial::ExchangeState(StateExchange& exchange) {
  exchange(range, bearing, geom, pose, mod, id);
}

void ModelFiducial::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(max_range_anon, max_range_id, min_range, fov, heading, key, ignore_zloc, fiducials_);
  if (!exchange.restoring()) return;
  FiducialIndex& index = *host().fiducials;
  if (subs > 0)
    index.AddFinder(this);
  else
    index.RemoveFinder(this);
}

void ModelFiducial::ForgetTarget(const Model* target) {
  std::erase_if(fiducials_, [target](const Fiducial& f) { return f.mod == target; });
  for (Fiducial& candidate : candidates_)
    if (candidate.mod == target) candidate.mod = nullptr;
}

}  // namespace Stg
