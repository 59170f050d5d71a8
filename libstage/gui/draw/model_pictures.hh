// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws what belongs to models apart from their bodies: sensor data, flags, speech, selection
// marks. All poses are global.

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

/// Returns an interval of this length, centred at 0.
inline Bounds Half(double size) { return Bounds(-size / 2, size / 2); }

// ---- device data (types/) ----

/// Paintings for device data: on the floor, occluded by higher things, or never occluded.
struct Layers {
  Painting *floor, *data, *over;
};

/// Draws what a sensor has measured, apart from the area that several rays have swept. `place`:
/// where its rays began.
void DrawSensor(const ModelRanger::Sensor& sensor, const Pose& place,
                const view::ViewOptions& options, Painting* painting);
/// Draws the sensors of a ranger, with their numbers. `global`: its present pose.
void DrawTransducers(const ModelRanger& ranger, const Pose& global, Painting* over);

// ---- everything else (model_pictures.cc) ----

void DrawFlags(const Model& model, const Pose& global, Painting* painting);
void DrawSpeech(const Model& model, const Pose& global, Painting* painting);
void DrawBoundingBox(const Model& model, const Pose& global, Painting* painting);
void DrawSelected(Model& model, const view::Projection& projection, Painting* marks,
                  Painting* over);
/// Draws a triangle that points along the frame's x axis.
void DrawArrow(Painter* painter);
/// `top`: top of the body in the model's frame. `step`: metres between numbers.
void DrawModelGrid(const Model& model, const Pose& global, double top, double step,
                   Painting* painting);
/// Draws the result of the model's last Rasterize() call, if any.
void DrawRaster(const Model& model, const Pose& global, Painting* marks, Painting* over);
void DrawDissipation(const DissipationVis& heat, Painting* painting);
/// Height of a model including its tallest stack of children, metres.
double StackHeight(const Model& model);

/// Distance between axis numbers in metres: 1, 2 or 5 times a power of ten, at least 1.
double AxisStep(double pixels_per_metre);
void DrawAxisNumbers(const Bounds& x, const Bounds& y, double step,
                     const view::Projection& projection, Painting* painting);

}  // namespace Stg::draw

#endif
