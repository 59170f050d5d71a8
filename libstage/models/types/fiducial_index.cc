// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/fiducial_index.hh"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <new>

#include "messages/assert.hh"
#include "models/fiducial.hh"

namespace Stg {

namespace {

/// Metres. Half the usual range of a finder: it then searches five strips and few targets too far
/// left or right.
constexpr double kStripWidth = 4.0;

double StripAt(double x) { return std::floor(x / kStripWidth); }

bool Older(const Model* a, const Model* b) { return a->GetId() < b->GetId(); }

}  // namespace

bool FiducialIndex::Place::operator<(const Place& o) const {
  if (strip != o.strip) return strip < o.strip;
  if (y != o.y) return y < o.y;
  return target < o.target;
}

void FiducialIndex::Refresh(const std::vector<Model*>& models) {
  sightings_known_ = false;  // finders may now find and keep new targets
  if (frozen_ && is_current_) return;
  found_.clear();
  for (Model* model : models) {
    if (model->vis.fiducial_return == 0) continue;
    const Pose pose = model->GetGlobalPose();
    if (std::isfinite(pose.x) && std::isfinite(pose.y)) found_.push_back({model, pose});
  }
  const auto same_place = [](const Target& a, const Target& b) {
    return a.pose.x == b.pose.x && a.pose.y == b.pose.y;
  };
  if (places_.size() != found_.size() || !std::ranges::equal(found_, targets_, same_place))
    SortPlaces();
  targets_.swap(found_);
  is_current_ = true;
}

/// Sorts the places of the targets in `found_`.
void FiducialIndex::SortPlaces() {
  places_.clear();
  places_.reserve(found_.size());  // throws here or not at all: never are there too few places
  for (uint32_t i = 0; i < found_.size(); i++)
    places_.push_back({StripAt(found_[i].pose.x), found_[i].pose.y, i});
  std::sort(places_.begin(), places_.end());
}

const std::vector<uint32_t>& FiducialIndex::Near(double x, double y, double reach) const {
  STAGE_ASSERT(is_current_ && places_.size() == targets_.size());  // after Refresh()
  static thread_local std::vector<uint32_t> near;                  // static to reuse its memory
  near.clear();
  if (!std::isfinite(x) || !std::isfinite(y) || !(reach >= 0)) return near;
  const double last_strip = StripAt(x + reach);
  const Place from{StripAt(x - reach), y - reach, 0};
  auto place = std::lower_bound(places_.begin(), places_.end(), from);
  while (place != places_.end() && place->strip <= last_strip) {
    const double strip = place->strip;
    // `place` may be in a later strip than intended, so the search in its strip starts here.
    place = std::lower_bound(place, places_.end(), Place{strip, y - reach, 0});
    for (; place != places_.end() && place->strip == strip && place->y <= y + reach; ++place)
      if (std::fabs(targets_[place->target].pose.x - x) <= reach) near.push_back(place->target);
    // Next strip. nextafter() because adding 1 has no effect on very large numbers.
    const double beyond = std::nextafter(strip, std::numeric_limits<double>::infinity());
    place = std::lower_bound(place, places_.end(), Place{beyond, y - reach, 0});
  }
  std::sort(near.begin(), near.end());
  return near;
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
  places_.clear();
  finders_.clear();
  sightings_.clear();
  sightings_known_ = false;
}

}  // namespace Stg
