// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/bumper.hh"

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr Rgba kRed = {255, 0, 0, 255};
constexpr Rgba kGreen = {0, 255, 0, 255};

/// Draws bars with a line along them, because a bar is thinner than a pixel in most views. Bars
/// that are hit are never occluded, since the obstacle often lies above them.
void DrawBumper(const ModelBumper& bumper, const Pose& global, const Layers& layers) {
  constexpr double kThickness = 0.01;
  if (!bumper.samples) return;
  const Pose frame = global + bumper.GetGeom().pose;
  for (uint32_t i = 0; i < bumper.bumper_count; i++) {
    const bool hit = bumper.samples[i].hit;
    const Bounds along = Half(bumper.bumpers[i].length);
    Painter painter(hit ? layers.over : layers.data);
    painter.SetFrame(frame + bumper.bumpers[i].pose);
    painter.SetColor(hit ? kRed : kGreen);
    painter.Rectangle(Half(kThickness), along, 0);
    painter.Line({0, along.min, 0}, {0, along.max, 0}, true);
  }
}

void Draw(ModelBumper& bumper, const Pose& global, const DataFrame& frame) {
  if (frame.options[Show::kBumpers]) DrawBumper(bumper, global, frame.layers);
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelBumper>({Show::kBumpers}, Draw));

}  // namespace

}  // namespace Stg::draw
