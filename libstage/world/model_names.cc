// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/model_names.hh"

#include <algorithm>

#include "world/engine.hh"

namespace Stg {

void ModelNames::Add(const Model* model, const std::string& name) { ids_[name] = model->GetId(); }

Model* ModelNames::Find(const std::string& name, const WorldEngine& engine) const {
  const auto found = ids_.find(name);
  return found == ids_.end() ? nullptr : engine.FindModel(found->second);
}

void ModelNames::NoteRemoved(const WorldEngine& engine) {
  constexpr size_t kFew = 1000;
  if (++removed_ < std::max(kFew, engine.models.size())) return;
  removed_ = 0;
  looked_at_ += ids_.size();
  std::erase_if(ids_, [&](const auto& entry) { return !engine.FindModel(entry.second); });
}

void ModelNames::Clear() {
  ids_.clear();
  removed_ = 0;
}

}  // namespace Stg
