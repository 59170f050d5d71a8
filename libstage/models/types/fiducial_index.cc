// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/fiducial_index.hh"

#include <algorithm>
#include <cmath>
#include <functional>
#include <new>

#include "messages/assert.hh"
#include "models/fiducial.hh"

namespace Stg {

namespace {

bool Older(const Model* a, const Model* b) { return a->GetId() < b->GetId(); }

}  // namespace

void FiducialIndex::Refresh(const std::vector<Model*>& models) {
  sightings_known_ = false;  // finders may now find and keep new targets
  if (frozen_ && is_current_) return;
  is_current_ = false;  // in case of an exception
  targets_.clear();
  points_.clear();
  for (Model* model : models) {
    if (model->vis.fiducial_return == 0) continue;
    const Pose pose = model->GetGlobalPose();
    if (!std::isfinite(pose.x) || !std::isfinite(pose.y)) continue;
    targets_.push_back({model, pose});
    points_.emplace_back(pose.x, pose.y);
  }
  places_.Replace(&points_);
  is_current_ = true;
}

const std::vector<uint32_t>& FiducialIndex::Near(double x, double y, double reach) const {
  STAGE_ASSERT(is_current_ && places_.size() == targets_.size());  // after Refresh()
  return places_.Near(x, y, reach);
}

void FiducialIndex::AddFinder(ModelFiducial* finder) {
  const auto place = std::lower_bound(finders_.begin(), finders_.end(), finder, Older);
  if (place == finders_.end() || *place != finder) finders_.insert(place, finder);
}

void FiducialIndex::RemoveFinder(ModelFiducial* finder) {
  const auto place = std::lower_bound(finders_.begin(), finders_.end(), finder, Older);
  if (place != finders_.end() && *place == finder) finders_.erase(place);
}

void FiducialIndex::Forget(const Model* model) {
  is_current_ = false;
  if (model)
    ForgetSightings(model);
  else
    sightings_known_ = false;
}

/// The sightings are kept, because clients that delete one model often delete more.
void FiducialIndex::ForgetSightings(const Model* target) {
  if (!sightings_known_ && !CollectSightings()) {
    for (ModelFiducial* finder : finders_) finder->ForgetTarget(target);
    return;
  }
  const auto before = [](const Sighting& a, const Sighting& b) {
    return std::less<const Model*>()(a.target, b.target);
  };
  const auto range =
      std::equal_range(sightings_.begin(), sightings_.end(), Sighting{target, 0}, before);
  for (auto sighting = range.first; sighting != range.second; ++sighting) {
    looked_at_++;
    const auto finder =
        std::lower_bound(finders_.begin(), finders_.end(), sighting->finder,
                         [](const Model* m, uint32_t id) { return m->GetId() < id; });
    if (finder != finders_.end() && (*finder)->GetId() == sighting->finder)
      (*finder)->ForgetTarget(target);
  }
}

/// Returns false if memory is exhausted.
bool FiducialIndex::CollectSightings() {
  sightings_.clear();
  try {
    for (ModelFiducial* finder : finders_)
      finder->ForEachTarget([&](const Model* target) {
        sightings_.push_back({target, finder->GetId()});
      });
  } catch (const std::bad_alloc&) {
    return false;
  }
  sightings_known_ = true;
  looked_at_ += sightings_.size();
  std::sort(sightings_.begin(), sightings_.end(), [](const Sighting& a, const Sighting& b) {
    return std::less<const Model*>()(a.target, b.target);
  });
  return true;
}

void FiducialIndex::Clear() {
  is_current_ = false;
  targets_.clear();
  places_.Clear();
  finders_.clear();
  sightings_.clear();
  sightings_known_ = false;
}

}  // namespace Stg
