// SPDX-License-Identifier: GPL-2.0-or-later
//
// What is under the pointer, by geometry: lines of sight against the bodies of models.

#ifndef STAGE_GUI_WINDOW_PICKING_HH
#define STAGE_GUI_WINDOW_PICKING_HH

#include <vector>

#include "gui/view/projection.hh"

namespace Stg {
class Model;
class World;
}  // namespace Stg

namespace Stg::internal::window {

/// The top-level model that may be dragged and whose body, or that of a descendant, is the first
/// that the line of sight meets. Others don't hide it. Null if there is none.
Model* PickModel(const World& world, const view::Projection::Sight& sight);

/// The same for models that are only specks: the one whose origin is nearest to the pixel (from the
/// left and the top of the canvas), if it is near enough.
Model* PickSpeck(const World& world, const view::Projection& projection, double x, double y);

/// What is selected, in the order of selecting.
class Selection {
 public:
  const std::vector<Model*>& models() const { return models_; }
  /// The one that was clicked last; it stays when the selection is cleared.
  Model* last() const { return last_; }
  bool empty() const { return models_.empty(); }
  bool Contains(const Model* model) const;

  void SelectOnly(Model* model);
  void Toggle(Model* model);
  void Clear() { models_.clear(); }
  /// Makes it the last one, without selecting it. May be null.
  void SetLast(Model* model) { last_ = model; }
  /// The model is going.
  void Forget(const Model* model);

 private:
  std::vector<Model*> models_;
  Model* last_ = nullptr;
};

}  // namespace Stg::internal::window

#endif
