// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds the model under the pointer by intersecting lines of sight with bodies.

#ifndef STAGE_GUI_WINDOW_PICKING_HH
#define STAGE_GUI_WINDOW_PICKING_HH

#include <vector>

#include "gui/view/projection.hh"

namespace Stg {
class Model;
class World;
}  // namespace Stg

namespace Stg::internal::window {

/// Returns the movable top-level model whose tree the line of sight meets first, or null. Immovable
/// models do not occlude it.
Model* PickModel(const World& world, const view::Projection::LineOfSight& sight);

/// Like PickModel(), for models that appear as specks: returns the one whose origin is nearest to
/// the pixel, or null if none is near. Pixels count from the left and top of the canvas.
Model* PickSmallModel(const World& world, const view::Projection& projection, double x, double y);

/// The selected models in the order of selection.
class Selection {
 public:
  const std::vector<Model*>& models() const { return models_; }
  /// The model clicked last; Clear() keeps it.
  Model* last() const { return last_; }
  bool empty() const { return models_.empty(); }
  bool Contains(const Model* model) const;

  void SelectOnly(Model* model);
  void Toggle(Model* model);
  void Clear() { models_.clear(); }
  /// Sets the last model, which may be null, without selecting it.
  void SetLast(Model* model) { last_ = model; }
  /// Call when the model is about to be deleted.
  void Forget(const Model* model);

 private:
  std::vector<Model*> models_;
  Model* last_ = nullptr;
};

}  // namespace Stg::internal::window

#endif
