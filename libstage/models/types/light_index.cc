// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/light_index.hh"

#include <algorithm>
#include <cmath>

#include "models/light.hh"

namespace Stg {

namespace {

bool IsBefore(const LightSource* a, const LightSource* b) {
  return a->model().GetId() < b->model().GetId();
}

}  // namespace

void LightIndex::Add(LightSource* light) {
  sources_.insert(std::upper_bound(sources_.begin(), sources_.end(), light, IsBefore), light);
  is_current_ = false;
}

void LightIndex::Remove(const LightSource* light) {
  sources_.erase(std::lower_bound(sources_.begin(), sources_.end(), light, IsBefore));
  is_current_ = false;
}

void LightIndex::Refresh() {
  if (frozen_ && is_current_) return;
  is_current_ = false;  // in case of an exception
  lights_.clear();
  points_.clear();
  for (const LightSource* source : sources_) {
    if (!(source->GetIntensity() > 0) || !source->IsOn()) continue;
    const Model& model = source->model();
    const Pose pose = model.GetGlobalPose() + model.GetGeom().pose;
    if (!std::isfinite(pose.x) || !std::isfinite(pose.y)) continue;
    const Color color = model.GetColor();
    lights_.push_back(
        {model.Root(), point_t(pose.x, pose.y), source->GetIntensity(), color.r, color.g, color.b});
    points_.push_back(lights_.back().place);
  }
  places_.Replace(&points_);
  is_current_ = true;
}

}  // namespace Stg
