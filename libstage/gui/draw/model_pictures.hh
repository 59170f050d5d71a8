// SPDX-License-Identifier: GPL-2.0-or-later
//
// How models look apart from their bodies: what devices have sensed, what models carry and say,
// marks of the user. All poses are global.

#ifndef STAGE_GUI_DRAW_MODEL_PICTURES_HH
#define STAGE_GUI_DRAW_MODEL_PICTURES_HH

#include "gui/draw/painter.hh"
#include "gui/view/projection.hh"
#include "gui/view/view_options.hh"
#include "models/ranger.hh"

namespace Stg {
class DissipationVis;
class Model;
}  // namespace Stg

namespace Stg::draw {

// ---- device data (types/) ----

/// Where device data go: on the floor, hidden by what is higher, or hidden by nothing.
struct Layers {
  Painting *floor, *data, *over;
};

/// The ranger's sensor of that index, apart from the area that its rays have swept.
void DrawSensor(const ModelRanger::Sensor& sensor, size_t index, const Pose& place,
                const view::ViewOptions& options, const Layers& layers);

// ---- the rest (model_pictures.cc) ----

void DrawFlags(const Model& model, const Pose& global, Painting* painting);
void DrawSpeech(const Model& model, const Pose& global, Painting* painting);
void DrawBoundingBox(const Model& model, const Pose& global, Painting* painting);
void DrawSelected(Model& model, const view::Projection& projection, Painting* marks,
                  Painting* over);
/// A triangle along the frame's x axis.
void DrawArrow(Painter* painter);
/// `top`: of the body, in the model's frame. `step`: metres between numbers.
void DrawModelGrid(const Model& model, const Pose& global, double top, double step,
                   Painting* painting);
/// What the model's last Rasterize() gave, if it was ever called.
void DrawRaster(const Model& model, const Pose& global, Painting* marks, Painting* over);
void DrawDissipation(const DissipationVis& heat, Painting* painting);
/// Height of a model with its tallest stack of children on top.
double StackHeight(const Model& model);

/// Metres between the numbers of the axes: 1, 2 or 5, or one of these times a power of ten.
double AxisStep(double pixels_per_metre);
void DrawAxisNumbers(const Bounds& x, const Bounds& y, double step,
                     const view::Projection& projection, Painting* painting);

}  // namespace Stg::draw

#endif
