// SPDX-License-Identifier: GPL-2.0-or-later
//
// Models that cast rays: how their fans enter the batch.

#include <cmath>

#include "messages/assert.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/model_seed.hh"
#include "models/model_type.hh"
#include "models/self_masks.hh"
#include "random/fnv1a.hh"
#include "sensing/scene.hh"

namespace Stg {

/// Depends on the name only, unless another model has had the same name.
uint64_t Model::NoiseSeed(const std::string& device) const {
  return SeedOfNoise(world_base_->seed(), Fnv1a(device), shares_name_, random_.seed());
}

void Model::Reseed(uint64_t seed) { random_.Restart(MixSeeds(random_.seed(), seed)); }

void Model::PlaceFan(sensing::Fan* fan, const Pose& origin, meters_t range, RayModel model) {
  fan->exact = host().IsExact(model);
  if (fan->exact) host().RasterizeForExactRays();
  sensing::PlaceFan(fan, origin, range, scene_->cells_per_metre);
  fan->layer = scene_->grid.EverythingLayer(fan->exact);
}

void Model::AddRays(FanList* fans, const RayFan& rays) {
  STAGE_ASSERT(rays.sink && rays.test);
  if (rays.rays == 0) return;
  sensing::Fan fan;
  fan.predicate = rays.test;
  fan.finder = this;
  fan.sink = rays.sink;
  fan.tag = rays.tag;
  fan.z_test = !rays.any_height;
  fan.record.first_direction =
      scene_->tables.Find(std::isfinite(rays.fov) ? rays.fov : 0, rays.rays);
  PlaceFan(&fan, rays.origin, rays.range > 0 ? rays.range : 0, RayModel::kDefault);
  const ModelType* const own = FindModelType(*this);
  fans->Add(fan, rays.rays, own && (own->updates & ModelType::kIgnoresOwnTree));
}

void Model::FinishRays() { host().FinishRaysOf(this); }

void Model::CollectRasterizations(grid::Rasterizations* rasterizations, bool exact) const {
  blockgroup->AppendRasterizations(rasterizations, exact);
  for (const Model* child : children) child->CollectRasterizations(rasterizations, exact);
}

sensing::BatchSpace Model::MeasureSpace(sensing::FanList* fans, PendingSelfMasks* masks) {
  const size_t first = fans->size();
  Gather(fans);
  sensing::BatchSpace space;
  for (const sensing::FanList::Entry& listed : fans->From(first)) {
    space += listed;
    if (listed.ignores_own_tree) space.words += masks->Reserve(*this, listed.fan.exact);
  }
  return space;
}

bool Model::FillSpace(sensing::BatchSpace place, const sensing::FanList& fans, size_t first_fan,
                      size_t count) {
  bool layers_found = true;
  STAGE_ASSERT(first_fan + count <= fans.size());
  for (const sensing::FanList::Entry& listed : fans.From(first_fan).first(count)) {
    const sensing::Fan& fan = listed.fan;
    STAGE_ASSERT(fan.finder == this && fan.sink && fan.predicate);
    scene_->batch.Put(
        place, fans, listed,
        listed.ignores_own_tree ? root->self_masks_->of[fan.exact].mask : sensing::SelfMask());
    layers_found &= fan.layer != grid::kNoLayer;
    place += listed;
  }
  return layers_found;
}

void Model::GatherSerially() {
  sensing::Scene& shared = *scene_;
  const unsigned needs = Preparations();
  if (needs & kExactRays) host().RasterizeForExactRays();
  if (needs & kNeedsPreparation) FinishPreparation();
  shared.fans.Clear();
  PendingSelfMasks masks;
  const sensing::BatchSpace space = MeasureSpace(&shared.fans, &masks);
  STAGE_ASSERT(space.fans >= shared.fans.size());
  if (space.fans == 0) return;
  const sensing::BatchSpace place = shared.batch.Allocate(space);
  masks.Place(*this, place.words);
  masks.Fill(*this);
  if (!FillSpace(place, shared.fans, 0, shared.fans.size())) shared.MakeLayers(place.fans, this);
}

const grid::Rasterizations& Model::OwnRasterizations(bool exact) const {
  static thread_local grid::Rasterizations rasterizations;  // static to reuse its memory
  rasterizations.of_bodies.clear();
  CollectRasterizations(&rasterizations, exact);
  return rasterizations;
}

}  // namespace Stg
