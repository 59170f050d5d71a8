// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws the messages that a radio has received: a line from where it has measured the sender.

#include "models/radio.hh"

#include <cmath>

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

void DrawMessages(const ModelRadio& radio, Painter* painter) {
  constexpr double kHead = 0.15;  // length of an arrow's head, as a fraction of the line
  // Ranges and bearings are relative to the pose before the step's moves.
  const Pose sensed = radio.GetSensedPose();
  painter->SetColor({255, 140, 0, 255});
  for (const ModelRadio::Message& message : radio.Received()) {
    const double range = Finite(message.range), head = kHead * range;
    painter->SetFrame(sensed + Pose(0, 0, 0, message.bearing));
    painter->Line({0, 0, 0}, {range, 0, 0});
    painter->Line({0, 0, 0}, {head, head / 3, 0});
    painter->Line({0, 0, 0}, {head, -head / 3, 0});
  }
}

void Draw(ModelRadio& radio, const Pose&, const DataFrame& frame) {
  if (!frame.options[view::Show::kRadio]) return;
  Painter painter(frame.layers.data);
  DrawMessages(radio, &painter);
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelRadio>({view::Show::kRadio}, Draw));

}  // namespace

}  // namespace Stg::draw
