// SPDX-License-Identifier: GPL-2.0-or-later
//
// The inputs of one update of a scene, private to render_scene.cc.

#ifndef STAGE_GUI_DRAW_SCENE_JOB_HH
#define STAGE_GUI_DRAW_SCENE_JOB_HH

#include "gui/draw/render_scene.hh"
#include "world/world.hh"

namespace Stg::draw {

struct RenderScene::Job {
  World& world;
  const view::ViewState& view;
  const Selection& selection;
  int width, height;

  bool shows_data() const { return view.options[view::Show::kData] && world.SimTimeNow() > 0; }
  /// With "Selected only", data are shown for the selected models, or for the one selected last.
  bool shows_data_of(Model& model) const {
    if (!view.options[view::Show::kSelectedOnly]) return true;
    if (selection.models.empty()) return selection.last && model.Root() == selection.last->Root();
    return selection.Has(model.Root());
  }
};

}  // namespace Stg::draw

#endif
