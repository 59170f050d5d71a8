// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/model_names.hh"

#include <algorithm>

#include "models/host.hh"

namespace Stg {

void ModelNames::Add(const Model* model, const std::string& name) {
  ids_[name] = model->GetId();
  version_++;
}

Model* ModelNames::Find(const std::string& name, const Host& host) const {
  const auto found = ids_.find(name);
  return found == ids_.end() ? nullptr : host.FindModel(found->second);
}

void ModelNames::NoteRemoved(const Host& host) {
  constexpr size_t kFew = 1000;
  if (++removed_ >= std::max(kFew, host.models.size())) RemoveStale(host);
}

void ModelNames::RemoveStale(const Host& host) {
  if (removed_ == 0) return;
  removed_ = 0;
  version_++;
  looked_at_ += ids_.size();
  std::erase_if(ids_, [&](const auto& entry) { return !host.FindModel(entry.second); });
}

void ModelNames::Clear() {
  ids_.clear();
  version_++;
  removed_ = 0;
}

}  // namespace Stg
