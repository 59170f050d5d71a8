// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/gripper.hh"

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr Rgba kYellow = {255, 255, 0, 255};

/// Draws the sensors on the inner faces of the fingers.
void DrawGripper(ModelGripper& gripper, const Pose& global, Painting* data) {
  constexpr double kMark = 0.02, kStrip = 0.01;
  const ModelGripper::config_t config = gripper.GetConfig();
  const Geom geom = gripper.GetGeom();
  const Size& body = geom.size;
  const double finger = body.y * config.paddle_size.y;
  const double inner = (1 - config.paddle_position) * (body.y / 2 - finger);
  const double lift = config.lift_position * (1 - config.paddle_size.z);
  const double top = body.z * (lift + config.paddle_size.z) + 0.005;
  Painter painter(data);
  painter.SetFrame(global + geom.pose);
  const auto mark = [&](const Bounds& x, const Bounds& y, bool active) {
    painter.SetColor(kYellow);
    if (active) painter.Rectangle(x, y, top);
    painter.SetColor(kBlack);
    painter.RectangleOutline(x, y, top);
  };
  const double middle = inner + finger / 2;
  for (size_t i = 0; i < 2; i++) {
    const double x = body.x * (0.5 - config.break_beam_inset[i]);
    for (const double y : {middle, -middle})
      mark(Bounds(x - kMark / 2, x + kMark / 2), Bounds(y - kMark / 2, y + kMark / 2),
           config.beam[i] != nullptr);
  }
  const Bounds along(body.x * (0.5 - config.paddle_size.x), body.x / 2);
  mark(along, Bounds(inner, inner + kStrip), config.contact[0] != nullptr);
  mark(along, Bounds(-inner - kStrip, -inner), config.contact[1] != nullptr);
}

void Draw(ModelGripper& gripper, const Pose& global, const DataFrame& frame) {
  if (frame.options[Show::kGripper]) DrawGripper(gripper, global, frame.layers.data);
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelGripper>({Show::kGripper}, Draw));

}  // namespace

}  // namespace Stg::draw
