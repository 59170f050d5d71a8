// SPDX-License-Identifier: GPL-2.0-or-later

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "gui/draw/model_pictures.hh"
#include "models/blobfinder.hh"
#include "models/bumper.hh"
#include "models/camera.hh"
#include "models/fiducial.hh"
#include "models/gripper.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "models/wifi.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr Rgba kRed = {255, 0, 0, 255}, kGreen = {0, 255, 0, 255}, kBlue = {0, 0, 255, 255};
constexpr Rgba kYellow = {255, 255, 0, 255};
constexpr double kFarthest = 1e5;  // m; what is infinite ends here

Bounds Half(double size) { return Bounds(-size / 2, size / 2); }
double Finite(double length) {
  return std::isfinite(length) ? std::min(length, kFarthest) : kFarthest;
}

/// Directions of the picture's right and up in the world, and towards the viewer.
struct Screen {
  point3_t right, up, out;
};
Screen ScreenOf(const view::Projection& projection) {
  const view::Matrix& m = projection.modelview();
  return {point3_t(m[0], m[4], m[8]), point3_t(m[1], m[5], m[9]), point3_t(m[2], m[6], m[10])};
}

// ---- blobfinder ---------------------------------------------------------------------------------

void DrawBlobs(const ModelBlobfinder& finder, const Pose& global,
               const view::Projection& projection, Painting* painting) {
  constexpr double kPixel = 0.025;                         // m
  constexpr double kLeft = -2.5, kDown = -1.5, kUp = 0.5;  // m from the finder
  const Screen screen = ScreenOf(projection);
  const auto at = [&](double column, double row, double out = 0) {
    const double x = column * kPixel, y = (finder.scan_height - row) * kPixel;
    return point3_t(kLeft + x * screen.right.x + y * screen.up.x + out * screen.out.x,
                    kDown + x * screen.right.y + y * screen.up.y + out * screen.out.y,
                    kUp + x * screen.right.z + y * screen.up.z + out * screen.out.z);
  };
  Painter painter(painting);
  painter.SetFrame(Pose(global.x, global.y, global.z, 0));
  const double w = finder.scan_width, h = finder.scan_height;
  painter.SetColor(kWhite);
  painter.Quad(at(0, 0), at(w, 0), at(w, h), at(0, h));
  for (const ModelBlobfinder::Blob& blob : finder.GetBlobs()) {
    painter.SetColor(ToRgba(blob.color).WithOpacity(1));
    painter.Quad(at(blob.left, blob.top), at(blob.right + 1.0, blob.top),
                 at(blob.right + 1.0, blob.bottom), at(blob.left, blob.bottom));
  }
  painter.SetColor(kRed);
  const point3_t corners[] = {at(0, 0, kPixel), at(w, 0, kPixel), at(w, h, kPixel),
                              at(0, h, kPixel)};
  for (size_t i = 0; i < 4; i++) painter.Line(corners[i], corners[(i + 1) % 4]);
}

// ---- fiducial -----------------------------------------------------------------------------------

void DrawFiducials(ModelFiducial& finder, const Pose& global, const view::ViewOptions& options,
                   const Layers& layers) {
  Painter painter(layers.data), marks(layers.over);
  painter.SetFrame(global);
  if (options[Show::kFiducialFov]) {
    painter.SetColor({255, 0, 255, Rgba::Part(0.4)});
    painter.SectorOutline(Finite(finder.max_range_anon), -finder.fov / 2, finder.fov, 0,
                          finder.fov < 2 * M_PI);
  }
  if (!options[Show::kFiducials]) return;
  for (const ModelFiducial::Fiducial& found : finder.GetFiducials()) {
    const point3_t there(found.range * std::cos(found.bearing),
                         found.range * std::sin(found.bearing), 0);
    painter.SetFrame(global);
    painter.SetColor({255, 0, 255, Rgba::Part(0.5)});
    painter.DashedLine({0, 0, 0}, there, 0.1);
    const Pose target = global + Pose(there.x, there.y, 0, found.geom.a);
    marks.SetFrame(target);  // in the height of the finder, so within the target's body
    marks.SetColor({255, 0, 255, 255});
    marks.RectangleOutline(Half(found.geom.x), Half(found.geom.y), 0, true);
    char text[16];
    const int length = std::snprintf(text, sizeof text, "%d", found.id);
    marks.SetColor({160, 0, 160, 255});
    marks.Text({0, 0, 0.1}, std::string_view(text, static_cast<size_t>(length)));
  }
}

// ---- bumper and gripper -------------------------------------------------------------------------

/// Bars with a line along them, as they are thinner than a pixel in most views. Those that are hit
/// are often below what they have hit: nothing hides them.
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

/// The sensors lie on the fingers' inner faces.
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

// ---- camera -------------------------------------------------------------------------------------

/// Each pixel where the camera has seen it.
void DrawCamera(const ModelCamera& camera, Painting* data) {
  const float* depth = camera.FrameDepth();
  const unsigned char* color = camera.FrameColor();
  if (!depth || !color) return;
  const PerspectiveCamera& lens = camera.getCamera();
  const double pitch = dtor(lens.pitch());
  const double sine = std::sin(pitch), cosine = std::cos(pitch);
  Painter painter(data);
  // x to the right of the camera, y ahead, level.
  painter.SetFrame(Pose(lens.x(), lens.y(), lens.z(), dtor(lens.yaw())));
  const int width = camera.getWidth(), height = camera.getHeight();
  const double half_width = std::tan(dtor(lens.horizFov()) / 2),
               half_height = std::tan(dtor(lens.vertFov()) / 2);
  const auto at = [&](int i, int j, double d) {
    const double x = (2.0 * i / width - 1) * half_width * d;
    const double y = (2.0 * j / height - 1) * half_height * d;
    return point3_t(x, d * sine + y * cosine, -d * cosine + y * sine);
  };
  for (int j = 0; j < height; j++)
    for (int i = 0; i < width; i++) {
      const size_t pixel =
          static_cast<size_t>(j) * static_cast<size_t>(width) + static_cast<size_t>(i);
      const double d = depth[pixel];
      if (!(d < lens.farClip())) continue;
      const unsigned char* c = color + 4 * pixel;
      painter.SetColor({c[0], c[1], c[2], 255});
      painter.Quad(at(i, j, d), at(i + 1, j, d), at(i + 1, j + 1, d), at(i, j + 1, d));
    }
}

// ---- position -----------------------------------------------------------------------------------

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

// ---- rangers ------------------------------------------------------------------------------------

/// Most are inside of the robot's body, so nothing hides them.
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

}  // namespace

void DrawSensor(const ModelRanger::Sensor& sensor, size_t index, const Pose& place,
                const view::ViewOptions& options, const Layers& layers) {
  const size_t count = sensor.ranges.size();
  const bool single = sensor.sample_count == 1;
  const double reach = Finite(sensor.Reach());
  Painter painter(layers.data);
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
  if (options[Show::kRangerTransducers]) DrawTransducer(sensor, index, place, layers.over);
}

// ---- all ----------------------------------------------------------------------------------------

bool HasPicture(const Model& model) {
  return dynamic_cast<const ModelBlobfinder*>(&model) ||
         dynamic_cast<const ModelFiducial*>(&model) || dynamic_cast<const ModelBumper*>(&model) ||
         dynamic_cast<const ModelGripper*>(&model) || dynamic_cast<const ModelCamera*>(&model) ||
         dynamic_cast<const ModelWifi*>(&model);
}

void DrawData(Model& model, const Pose& global, const view::ViewOptions& options,
              const view::Projection& projection, const Layers& layers) {
  Painting *data = layers.data, *over = layers.over;
  if (const auto* robot = dynamic_cast<ModelPosition*>(&model)) {
    if (options[Show::kPositionWaypoints]) DrawWaypoints(*robot, data);
    if (options[Show::kPositionCoordinates]) DrawCoordinates(*robot, global, data, over);
  } else if (const auto* blobs = dynamic_cast<ModelBlobfinder*>(&model)) {
    if (options[Show::kBlobfinder]) DrawBlobs(*blobs, global, projection, data);
  } else if (auto* fiducial = dynamic_cast<ModelFiducial*>(&model)) {
    DrawFiducials(*fiducial, global, options, layers);
  } else if (const auto* bumper = dynamic_cast<ModelBumper*>(&model)) {
    if (options[Show::kBumpers]) DrawBumper(*bumper, global, layers);
  } else if (auto* gripper = dynamic_cast<ModelGripper*>(&model)) {
    if (options[Show::kGripper]) DrawGripper(*gripper, global, data);
  } else if (const auto* camera = dynamic_cast<ModelCamera*>(&model)) {
    if (options[Show::kCamera]) DrawCamera(*camera, data);
  } else if (const auto* wifi = dynamic_cast<ModelWifi*>(&model)) {
    if (options[Show::kWifi]) DrawWifi(*wifi, global, layers);
  }
}

}  // namespace Stg::draw
