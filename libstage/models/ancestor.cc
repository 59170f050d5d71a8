// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/ancestor.hh"

#include "models/model.hh"
#include "models/warn_about.hh"

namespace Stg {

Ancestor::Ancestor() : debug(false) {}

Ancestor::~Ancestor() { DeleteChildren(); }

void Ancestor::DeleteChildren() {
  // A child's destructor takes it off the list.
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
  // From the back: the youngest children go first when everything is deleted.
  for (size_t i = children.size(); i-- > 0;) {
    if (children[i] != mod) continue;
    children.erase(children.begin() + static_cast<long>(i));
    return;
  }
}

void Ancestor::ForEachDescendant(model_callback_t func, void* arg) {
  // By index and with a look at the size: func may add models.
  for (size_t i = 0; i < children.size(); i++) {
    Model* child = children[i];
    func(child, arg);
    child->ForEachDescendant(func, arg);
  }
}

Pose Ancestor::GetGlobalPose() const { return Pose(); }

void Ancestor::SetToken(const std::string& str) {
  if (str.empty()) {
    WarnAbout(*this, "found an empty name for it; it keeps its own");
    return;
  }
  token = str;
}

void* Ancestor::GetProperty(const std::string& key) const {
  const auto found = props.find(key);
  return found == props.end() ? nullptr : found->second;
}

}  // namespace Stg
