// SPDX-License-Identifier: GPL-2.0-or-later
//
// Names, parents and children of models, and the limit of nesting.

#include <algorithm>
#include <cstdio>
#include <string>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/warn_about.hh"

namespace Stg {

void Model::SetToken(const std::string& str) {
  Ancestor::SetToken(str);
  if (!str.empty()) RegisterName(token);
}

void Model::RegisterName(const std::string& name) {
  const Model* bearer = host().names.Find(name, host());
  shares_name_ = bearer != nullptr && bearer != this;
  host().names.Add(this, name);
}

Model* Model::GetChild(const std::string& name) const {
  return host().GetModel(token + "." + name);
}

Model* Model::GetUnusedModelOfType(const std::string& wanted) {
  if (type == wanted && !used) {
    used = true;
    return this;
  }
  for (Model* child : children)
    if (Model* found = child->GetUnusedModelOfType(wanted)) return found;
  if (!parent)
    WarnAbout(*this, "no unused model of type %s on it", messages::Quoted(wanted).c_str());
  return nullptr;
}

Model* Model::GetUnsubscribedModelOfType(const std::string& wanted) const {
  if (type == wanted && subs == 0) return const_cast<Model*>(this);
  for (const Model* child : children)
    if (Model* found = child->GetUnsubscribedModelOfType(wanted)) return found;
  return nullptr;
}

Model* Model::LookupId(uint32_t wanted) { return FindModelOfAnyWorld(wanted); }

void Model::Print(char* prefix) const {
  std::printf("%s%s %s:%s\n", prefix ? prefix : "", prefix ? " model" : "Model",
              Printable(world_base_->TokenStr()).c_str(), Printable(token).c_str());
  for (const Model* child : children) child->Print(prefix);
}

const char* Model::PrintWithPose() const {
  static thread_local std::string text;
  const Pose g = GetGlobalPose();
  char numbers[256];
  std::snprintf(numbers, sizeof numbers, " @ [%.2f,%.2f,%.2f,%.2f]", g.x, g.y, g.z, g.a);
  text = token + numbers;
  return text.c_str();
}

bool Model::IsAntecedent(const Model* testmod) const {
  for (const Model* above = parent; above; above = above->parent)
    if (above == testmod) return true;
  return false;
}

bool Model::IsDescendent(const Model* testmod) const {
  return testmod == this || testmod->IsAntecedent(this);
}

void Model::SetRoot(Model* new_root) {
  STAGE_ASSERT(new_root->parent == nullptr);
  root = new_root;
  for (Model* child : children) child->SetRoot(new_root);
}

/// Changes the parent; null means the world. Removes the model from the grid and keeps the pose
/// relative to the old parent.
void Model::MoveTo(Model* newparent) {
  STAGE_ASSERT(!newparent || (newparent->world == world && !IsDescendent(newparent)));
  host().topology_version++;
  UnMapWithChildren();
  ParentOrWorld().RemoveChild(this);
  parent = newparent;
  ParentOrWorld().AddChild(this);
  SetRoot(parent ? parent->root : this);
}

int Model::SetParent(Model* newparent) {
  if (newparent && RefusesParent(*newparent)) return 1;
  const Pose global = GetGlobalPose();
  MoveTo(newparent);
  pose = parent ? parent->LocalPoseOf(global, parent->GetGlobalPose()) : global;
  pose.a = normalize(pose.a);
  STAGE_ASSERT(Depth() + Height() <= kMaxDepth);
  Map();
  if (SurvivesCallbacks(CB_PARENT)) CallCallbacks(CB_POSE);
  return 0;
}

void Model::BecomeParentOf(Model* child) {
  if (child->RefusesParent(*this)) return;
  child->UnMapWithChildren();
  child->ParentOrWorld().RemoveChild(child);
  child->parent = this;
  AddChild(child);
  child->SetRoot(root);
  host().topology_version++;
  child->Map();
}

// ---- depth --------------------------------------------------------------------------------------

const unsigned int Model::kMaxDepth;

unsigned int Model::Depth() const {
  unsigned int depth = 0;
  for (const Model* above = parent; above; above = above->parent) depth++;
  return depth;
}

/// Number of levels of models below this one.
unsigned int Model::Height() const {
  unsigned int height = 0;
  for (const Model* child : children) height = std::max(height, child->Height() + 1);
  return height;
}

/// Functions that walk a tree recurse once per level, so nesting is limited, equally for all ways
/// of nesting.
Model* Model::LimitDepth(const WorldBase& world, Model* parent) {
  if (!parent || parent->Depth() < kMaxDepth) return parent;
  WarnAbout(world, "found a model to be nested more than %u deep; it is put at the top level",
            kMaxDepth);
  return nullptr;
}

bool Model::RefusesParent(const Model& newparent) const {
  if (IsDescendent(&newparent)) {
    WarnAbout(*this, "can't become a child of its own descendant %s",
              messages::Quoted(newparent.TokenStr()).c_str());
    return true;
  }
  if (newparent.Depth() + 1 + Height() <= kMaxDepth) return false;
  WarnAbout(*this, "found models to be nested more than %u deep; they stay where they are",
            kMaxDepth);
  return true;
}

}  // namespace Stg
