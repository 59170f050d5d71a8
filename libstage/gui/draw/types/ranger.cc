// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/ranger.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr Rgba kBlue = {0, 0, 255, 255};

/// Draws a transducer without occlusion, because most lie inside the robot's body.
void DrawTransducer(const ModelRanger::Sensor& sensor, size_t index, const Pose& place,
                    Painting* over) {
  Painter painter(over);
  painter.SetFrame(place);
  painter.SetColor(ToRgba(sensor.color).WithOpacity(1));
  painter.Rectangle(Half(sensor.size.x), Half(sensor.size.y), 0);
  painter.SetColor(kBlack);
  painter.Point(0, 0);
  painter.Text({sensor.size.x / 2, 0, 0}, std::to_string(index));
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelRanger>({Show::kRanger, Show::kRangerArea, Show::kRangerStrikes,
                                            Show::kRangerFov, Show::kRangerTransducers}));

}  // namespace

void DrawTransducers(const ModelRanger& ranger, const Pose& global, Painting* over) {
  const Pose frame = ranger.SensorFrame(global);
  const SineCosine turn = SinCos(frame.a);
  size_t index = 0;
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors())
    DrawTransducer(sensor, index++, ModelRanger::OriginOf(sensor, frame, turn), over);
}

void DrawSensor(const ModelRanger::Sensor& sensor, const Pose& place,
                const view::ViewOptions& options, Painting* painting) {
  const size_t count = sensor.ranges.size();
  const bool single = sensor.sample_count == 1;
  const double reach = Finite(sensor.Reach());
  Painter painter(painting);
  painter.SetFrame(place);
  const Rgba color = ToRgba(sensor.color);
  if (options[Show::kRangerArea] && count == 1) {
    const double range = Finite(sensor.ranges[0]),
                 half = range * std::tan(std::min(sensor.fov, 3.0) / 2);
    painter.SetColor(color.WithOpacity(0.1));
    painter.Triangle({0, 0, 0}, {range, -half, 0}, {range, half, 0});
  }
  if (options[Show::kRangerStrikes]) {
    painter.SetColor(kBlue);
    for (size_t i = 0; i < count && i < sensor.bearings.size(); i++)
      if (sensor.ranges[i] < sensor.range.max)
        painter.Point(sensor.ranges[i] * std::cos(sensor.bearings[i]),
                      sensor.ranges[i] * std::sin(sensor.bearings[i]));
  }
  if (options[Show::kRangerFov]) {
    painter.SetColor(color.WithOpacity(0.5));
    if (single)
      painter.Line({0, 0, 0}, {reach, 0, 0});
    else
      painter.SectorOutline(reach, -sensor.fov / 2, sensor.fov, 0);
  }
}

}  // namespace Stg::draw
