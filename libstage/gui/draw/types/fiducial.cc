// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/fiducial.hh"

#include <cmath>
#include <cstdio>

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

using view::Show;

void DrawFiducials(ModelFiducial& finder, const Pose& global, const view::ViewOptions& options,
                   const Layers& layers) {
  Painter painter(layers.data), marks(layers.over);
  painter.SetFrame(global);
  if (options[Show::kFiducialFov]) {
    painter.SetColor({255, 0, 255, ColorByte(0.4)});
    painter.SectorOutline(Finite(finder.max_range_anon), -finder.fov / 2, finder.fov, 0,
                          finder.fov < 2 * M_PI);
  }
  if (!options[Show::kFiducials]) return;
  // Ranges and bearings are relative to the pose before the step's moves.
  const Pose sensed = finder.GetSensedPose();
  for (const ModelFiducial::Fiducial& found : finder.GetFiducials()) {
    const point3_t there(found.range * std::cos(found.bearing),
                         found.range * std::sin(found.bearing), 0);
    painter.SetFrame(sensed);
    painter.SetColor({255, 0, 255, ColorByte(0.5)});
    painter.DashedLine({0, 0, 0}, there, 0.1);
    const Pose target = sensed + Pose(there.x, there.y, 0, found.geom.a);
    marks.SetFrame(target);  // at the finder's height, and so inside the target's body
    marks.SetColor({255, 0, 255, 255});
    marks.RectangleOutline(Half(found.geom.x), Half(found.geom.y), 0, true);
    char text[16];
    const int length = std::snprintf(text, sizeof text, "%d", found.id);
    marks.SetColor({160, 0, 160, 255});
    marks.Text({0, 0, 0.1}, std::string_view(text, static_cast<size_t>(length)));
  }
}

void Draw(ModelFiducial& finder, const Pose& global, const DataFrame& frame) {
  DrawFiducials(finder, global, frame.options, frame.layers);
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelFiducial>({Show::kFiducials, Show::kFiducialFov}, Draw));

}  // namespace

}  // namespace Stg::draw
