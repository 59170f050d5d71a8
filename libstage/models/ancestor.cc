// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/ancestor.hh"

#include <algorithm>

#include "models/model.hh"
#include "models/warn_about.hh"

namespace Stg {

Ancestor::Ancestor() : debug(false) {}

Ancestor::~Ancestor() { DeleteChildren(); }

void Ancestor::DeleteChildren() {
  // A child's destructor removes it from the list.
  while (!children.empty()) delete children.back();
}

unsigned int Ancestor::CountOfType(const std::string& type) const {
  const auto found = child_type_counts.find(type);
  return found == child_type_counts.end() ? 0 : found->second;
}

void Ancestor::AddChild(Model* mod) {
  children.push_back(mod);
  child_type_counts[mod->GetModelType()]++;
}

void Ancestor::RemoveChild(Model* mod) {
  // The list is in the order of creation unless children have come from other parents.
  auto found =
      std::lower_bound(children.begin(), children.end(), mod,
                       [](const Model* a, const Model* b) { return a->GetId() < b->GetId(); });
  if (found == children.end() || *found != mod)
    found = std::find(children.begin(), children.end(), mod);
  if (found != children.end()) children.erase(found);
}

void Ancestor::ForEachDescendant(model_callback_t func, void* arg) {
  // By index: func may add models.
  for (size_t i = 0; i < children.size(); i++) {
    Model* child = children[i];
    func(child, arg);
    child->ForEachDescendant(func, arg);
  }
}

Pose Ancestor::GetGlobalPose() const { return Pose(); }

void Ancestor::SetToken(const std::string& str) {
  if (str.empty()) {
    WarnAbout(*this, "found an empty name; keeping the old one");
    return;
  }
  token = str;
}

void* Ancestor::GetProperty(const std::string& key) const {
  const auto found = props.find(key);
  return found == props.end() ? nullptr : found->second;
}

}  // namespace Stg
