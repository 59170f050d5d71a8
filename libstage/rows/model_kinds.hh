// SPDX-License-Identifier: GPL-2.0-or-later
//
// Kinds of models in rows: parts of movers, and what stands.

#ifndef STAGE_ROWS_MODEL_KINDS_HH
#define STAGE_ROWS_MODEL_KINDS_HH

#include <algorithm>
#include <string>

#include "messages/report.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/model_type.hh"

namespace Stg::rows {

inline std::string Named(const Model& model) { return messages::Quoted(model.TokenStr()); }

/// True if the model is exactly of the type that the world file calls `name`.
inline bool IsOfType(const Model& model, const char* name) {
  const ModelType* const type = FindModelType(model);
  return type && type->name == name;
}

inline bool IsRunning(const Model& model) { return model.HasSubscribers(); }

inline bool IsRobot(const Model& model) { return IsOfType(model, "position"); }

/// True if the model is a sensor that rows know.
inline bool IsSensor(const Model& model) {
  const ModelType* const type = FindModelType(model);
  return type && (type->name == "ranger" || type->name == "bumper" || type->name == "fiducial" ||
                  type->name == "blobfinder");
}

/// True if a sensor in the tree is running.
inline bool Senses(const Model& model) {
  return (IsSensor(model) && IsRunning(model)) ||
         std::ranges::any_of(model.GetChildren(),
                             [](const Model* child) { return Senses(*child); });
}

inline bool IsPushed(const Model& root) {
  return root.IsPushable() && root.host().contact_model == ContactModel::kOutlines;
}

/// True if the tree stands wherever its world places it.
inline bool IsPlaced(const Model& root) {
  return std::ranges::binary_search(root.host().placed, root.GetId());
}

/// True if the model belongs to a mover.
inline bool IsOfMover(const Model& model) {
  const Model& root = *model.Root();
  return IsRobot(root) || IsPushed(root) || IsPlaced(root) || Senses(root);
}

}  // namespace Stg::rows

#endif
