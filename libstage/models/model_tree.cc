// SPDX-License-Identifier: GPL-2.0-or-later
//
// How deep models may be nested.

#include <algorithm>

#include "messages/report.hh"
#include "models/model.hh"
#include "models/warn_about.hh"
#include "world/world.hh"

namespace Stg {

const unsigned int Model::kDeepest;

unsigned int Model::Depth() const {
  unsigned int depth = 0;
  for (const Model* above = parent; above; above = above->parent) depth++;
  return depth;
}

/// How many models lie below it, counted along the longest branch.
unsigned int Model::Height() const {
  unsigned int height = 0;
  for (const Model* child : children) height = std::max(height, child->Height() + 1);
  return height;
}

/// What walks along a tree calls itself for each model on the way down. So there is a limit to how
/// deep models can be nested, the same for all who nest them.
Model* Model::FitParent(const World& world, Model* parent) {
  if (!parent || parent->Depth() < kDeepest) return parent;
  WarnAbout(world, "found a model to be nested more than %u deep; it is put at the top level",
            kDeepest);
  return nullptr;
}

bool Model::RefusesParent(const Model& newparent) const {
  if (IsDescendent(&newparent)) {
    WarnAbout(*this, "can't become a child of its own descendant %s",
              messages::Quoted(newparent.TokenStr()).c_str());
    return true;
  }
  if (newparent.Depth() + 1 + Height() <= kDeepest) return false;
  WarnAbout(*this, "found models to be nested more than %u deep; they stay where they are",
            kDeepest);
  return true;
}

}  // namespace Stg
