// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/moved_models.hh"

namespace Stg::recording {

bool MovedModels::MustBeLogged(const Model& model, const ModelPose& now) {
  if (model.GetId() >= tracked_.size()) tracked_.resize(model.GetId() + size_t{1});
  Tracked& known = tracked_[model.GetId()];
  const Pose& p = now.pose;
  if (!begun_) known = {true, false, now.parent, p.x, p.y, p.z, p.a};
  known.moved = known.moved || !known.there || known.parent != now.parent || known.x != p.x ||
                known.y != p.y || known.z != p.z || known.a != p.a;
  return !begun_ || known.moved;
}

const std::vector<ModelPose>& MovedModels::FindMoved(const std::vector<Model*>& models) {
  found_.clear();
  for (const Model* model : models) {
    if (model->GetId() == 0) continue;  // the floor
    const Model* parent = model->Parent();
    const ModelPose now = {model->GetId(), parent ? parent->GetId() : 0, model->GetPose()};
    if (MustBeLogged(*model, now)) found_.push_back(now);
  }
  begun_ = true;
  return found_;
}

}  // namespace Stg::recording
