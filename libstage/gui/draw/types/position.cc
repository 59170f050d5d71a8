// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/position.hh"

#include <cmath>
#include <cstdio>

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr Rgba kRed = {255, 0, 0, 255};
constexpr Rgba kGreen = {0, 255, 0, 255};
constexpr Rgba kBlue = {0, 0, 255, 255};

void DrawWaypoints(const ModelPosition& robot, Painting* data) {
  constexpr double kTick = 0.15, kAbove = 0.02;
  if (robot.waypoints.empty()) return;
  Painter painter(data);
  const Pose* last = nullptr;
  for (const ModelPosition::Waypoint& waypoint : robot.waypoints) {
    const Pose& p = waypoint.pose;
    painter.SetFrame(robot.est_origin + p);
    painter.SetColor(ToRgba(waypoint.color));
    painter.Point(0, 0, kAbove);
    painter.Line({0, 0, kAbove}, {kTick, 0, kAbove}, true);
    painter.SetFrame(robot.est_origin);
    painter.SetColor(kRed.WithOpacity(0.3));
    if (last) painter.Line({last->x, last->y, kAbove}, {p.x, p.y, kAbove});
    last = &p;
  }
}

void DrawAxes(Painter* painter, const Pose& frame, const Rgba& color) {
  constexpr double kLength = 0.5;
  painter->SetFrame(frame);
  painter->SetColor(color);
  painter->Line({0, 0, 0}, {kLength, 0, 0}, true);
  painter->Line({0, 0, 0}, {0, kLength, 0}, true);
  painter->Line({0, 0, 0}, {0, 0, kLength}, true);
}

void DrawCoordinates(const ModelPosition& robot, const Pose& global, Painting* data,
                     Painting* over) {
  constexpr double kAbove = 0.02;
  Painter painter(data), labels(over);
  const Pose& e = robot.est_pose;
  DrawAxes(&painter, robot.est_origin, kRed);
  painter.DashedLine({0, 0, kAbove}, {e.x, 0, kAbove}, 0.1);
  painter.DashedLine({e.x, 0, kAbove}, {e.x, e.y, kAbove}, 0.1);
  labels.SetFrame(robot.est_origin);
  labels.SetColor(kRed);
  char text[32];
  int length = std::snprintf(text, sizeof text, "x:%.3f", e.x);
  labels.Text({e.x / 2, -0.1, kAbove}, std::string_view(text, static_cast<size_t>(length)));
  length = std::snprintf(text, sizeof text, "y:%.3f", e.y);
  labels.Text({e.x, e.y / 2, kAbove}, std::string_view(text, static_cast<size_t>(length)));
  DrawAxes(&painter, robot.est_origin + e, kGreen);
  const Geom geom = robot.GetGeom();
  DrawAxes(&painter, global + geom.pose, kBlue);
  painter.RectangleOutline(Half(geom.size.x), Half(geom.size.y), 0);
}

void Draw(ModelPosition& robot, const Pose& global, const DataFrame& frame) {
  if (frame.options[Show::kPositionWaypoints]) DrawWaypoints(robot, frame.layers.data);
  if (frame.options[Show::kPositionCoordinates])
    DrawCoordinates(robot, global, frame.layers.data, frame.layers.over);
}

[[maybe_unused]] const bool kRegistered = RegisterPicture(
    PictureOf<ModelPosition>({Show::kPositionCoordinates, Show::kPositionWaypoints}, Draw));

}  // namespace

}  // namespace Stg::draw
