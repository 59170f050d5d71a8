// SPDX-License-Identifier: GPL-2.0-or-later
//
// Models that cast rays: how their fans enter the batch.

#include "geometry/fnv1a.hh"
#include "messages/assert.hh"
#include "models/block.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/self_masks.hh"
#include "sensing/scene.hh"
#include "world/world.hh"

namespace Stg {

/// Depends on the name only, unless another model has had the same name.
uint64_t Model::NoiseSeed(const std::string& device) const {
  const uint64_t seed = world->seed() ^ Fnv1a(device);
  return shares_name_ ? MixSeeds(seed, random_.seed()) : seed;
}

void Model::Reseed(uint64_t seed) { random_.Restart(MixSeeds(random_.seed(), seed)); }

void Model::PlaceFan(sensing::Fan* fan, const Pose& origin, meters_t range, RayModel model) {
  fan->exact = world->IsExact(model);
  if (fan->exact) world->DrawForExactRays();
  sensing::PlaceFan(fan, origin, range, scene_->cells_per_metre);
  fan->layer = scene_->grid.EverythingLayer(fan->exact);
}

void Model::CollectDrawings(grid::Drawings* drawings, bool exact) const {
  blockgroup->AppendDrawings(drawings, exact);
  for (const Model* child : children) child->CollectDrawings(drawings, exact);
}

sensing::BatchShare Model::MeasureRoom(sensing::FanList* fans, SelfMasksToMake* masks) {
  const size_t first = fans->size();
  Gather(fans);
  sensing::BatchShare share;
  for (const sensing::FanList::Entry& listed : fans->From(first)) {
    share += listed;
    if (listed.past_own_tree) share.words += masks->Plan(*this, listed.fan.exact);
  }
  return share;
}

bool Model::FillRoom(sensing::BatchShare room, const sensing::FanList& fans, size_t first_fan,
                     size_t count) {
  bool layers_found = true;
  STAGE_ASSERT(first_fan + count <= fans.size());
  for (const sensing::FanList::Entry& listed : fans.From(first_fan).first(count)) {
    const sensing::Fan& fan = listed.fan;
    STAGE_ASSERT(fan.finder == this && fan.sink && fan.predicate);
    scene_->batch.Put(
        room, fans, listed,
        listed.past_own_tree ? root->self_masks_->of[fan.exact].mask : sensing::SelfMask());
    layers_found &= fan.layer != grid::kNoLayer;
    room += listed;
  }
  return layers_found;
}

void Model::GatherAlone() {
  sensing::Scene& shared = *scene_;
  const unsigned wants = GetReady();
  if (wants & kExactRays) world->DrawForExactRays();
  if (wants & kPartsThatLack) FinishGettingReady();
  shared.fans.Clear();
  SelfMasksToMake masks;
  const sensing::BatchShare share = MeasureRoom(&shared.fans, &masks);
  STAGE_ASSERT(share.fans >= shared.fans.size());
  if (share.fans == 0) return;
  const sensing::BatchShare room = shared.batch.AddRoom(share);
  masks.Place(*this, room.words);
  masks.Fill(*this);
  if (!FillRoom(room, shared.fans, 0, shared.fans.size())) shared.MakeLayers(room.fans, this);
}

const grid::Drawings& Model::OwnDrawings(bool exact) const {
  static thread_local grid::Drawings drawings;  // static to reuse its memory
  drawings.of_bodies.clear();
  CollectDrawings(&drawings, exact);
  return drawings;
}

}  // namespace Stg
