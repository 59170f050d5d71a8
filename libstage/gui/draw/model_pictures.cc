// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/model_pictures.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "models/body.hh"
#include "models/energy_charts.hh"
#include "models/flag.hh"
#include "models/model.hh"

namespace Stg::draw {

namespace {

constexpr Rgba kDarkGrey = {51, 51, 51, 255};
constexpr Rgba kGridBlue = {0, 0, 255, 102};
constexpr int kMaxLines = 2000;  // maximum number of grid lines per direction

std::string_view Number(double value, char* buffer, size_t size) {
  const int length = std::snprintf(buffer, size, "%.0f", value);
  return std::string_view(buffer, static_cast<size_t>(length));
}

/// Returns the body's frame in world coordinates.
Pose BodyFrame(const Model& model, const Pose& global) { return global + model.GetGeom().pose; }

void DrawOctahedron(Painter* painter, double z, double radius) {
  const point3_t top(0, 0, z + radius), bottom(0, 0, z - radius);
  const point3_t sides[] = {{radius, 0, z}, {0, radius, z}, {-radius, 0, z}, {0, -radius, z}};
  for (size_t i = 0; i < 4; i++) {
    painter->Line(sides[i], sides[(i + 1) % 4]);
    painter->Line(sides[i], top);
    painter->Line(sides[i], bottom);
  }
}

}  // namespace

void DrawFlags(const Model& model, const Pose& global, Painting* painting) {
  Painter painter(painting);
  painter.SetFrame(global);
  double z = 1;  // height of the lowest flag, m
  for (auto flag = model.flags().rbegin(); flag != model.flags().rend(); ++flag) {
    painter.SetColor(ToRgba((*flag)->GetColor()));
    DrawOctahedron(&painter, z, (*flag)->GetSize() / 2);
    z += (*flag)->GetSize();
  }
}

void DrawSpeech(const Model& model, const Pose& global, Painting* painting) {
  Painter painter(painting);
  painter.SetFrame(global);
  painter.Text({0, 0, 0.5}, model.speech(), Align::kLeft, LabelKind::kBubble);
}

double StackHeight(const Model& model) {
  double above = 0;
  for (const Model* child : model.GetChildren()) above = std::max(above, StackHeight(*child));
  return model.GetGeom().size.z + above;
}

void DrawBoundingBox(const Model& model, const Pose& global, Painting* painting) {
  const Size size = model.GetGeom().size;
  Painter painter(painting);
  painter.SetFrame(BodyFrame(model, global));
  painter.SetColor(ToRgba(model.GetColor()));
  const Bounds x = Half(size.x), y = Half(size.y);
  painter.RectangleOutline(x, y, 0, true);
  painter.RectangleOutline(x, y, size.z, true);
  for (const double px : {x.min, x.max})
    for (const double py : {y.min, y.max}) painter.Line({px, py, 0}, {px, py, size.z}, true);
  constexpr double kCross = 0.02;
  painter.Line({-kCross, 0, size.z}, {kCross, 0, size.z});
  painter.Line({0, -kCross, size.z}, {0, kCross, size.z});
}

void DrawSelected(Model& model, const view::Projection& projection, Painting* marks,
                  Painting* over) {
  constexpr double kLarger = 1.6, kAboveFloor = 0.01, kLabelOffset = 0.5;
  constexpr double kMinPixels =
      14;  // minimum size of a mark, pixels; a smaller one could not be seen
  const Pose global = model.GetGlobalPose();
  const Geom geom = model.GetGeom();
  Painter painter(marks);
  painter.SetFrame(BodyFrame(model, global));
  const double min_value = kMinPixels * projection.PixelAt(point3_t(global.x, global.y, global.z));
  const Bounds x = Half(std::max(kLarger * geom.size.x, min_value)),
               y = Half(std::max(kLarger * geom.size.y, min_value));
  painter.SetColor({0, 255, 0, ColorByte(0.4)});
  painter.Rectangle(x, y, kAboveFloor);
  painter.SetColor({0, 255, 0, ColorByte(0.8)});
  painter.RectangleOutline(x, y, kAboveFloor);

  char text[256];
  const int length = std::snprintf(text, sizeof text, "%s [%.2f %.2f %.2f %.2f]", model.Token(),
                                   global.x, global.y, global.z, rtod(global.a));
  Painter label(over);
  label.SetFrame(Pose(global.x, global.y, global.z, 0));
  label.Text({kLabelOffset, kLabelOffset, kLabelOffset},
             std::string_view(text, std::min(static_cast<size_t>(length), sizeof text - 1)));
}

void DrawArrow(Painter* painter) {
  constexpr double kLength = 0.2, kHalfWidth = 0.07;
  const point3_t tip(kLength, 0, 0), left(0, kHalfWidth, 0), right(0, -kHalfWidth, 0);
  painter->Line(tip, left);
  painter->Line(left, right);
  painter->Line(right, tip);
}

void DrawModelGrid(const Model& model, const Pose& global, double top, double step,
                   Painting* painting) {
  constexpr double kAbove = 0.01;
  const Size size = model.GetGeom().size;
  Painter painter(painting);
  const Pose frame = BodyFrame(model, global);
  painter.SetFrame(Pose(frame.x, frame.y, global.z, frame.a));
  painter.SetColor(kGridBlue);
  const Bounds x = Half(size.x), y = Half(size.y);
  const double z = top + kAbove;
  if (x.max - x.min > kMaxLines || y.max - y.min > kMaxLines) return;
  char text[32];
  for (double i = std::ceil(x.min); i <= x.max; i++) painter.Line({i, y.min, z}, {i, y.max, z});
  for (double i = std::ceil(y.min); i <= y.max; i++) painter.Line({x.min, i, z}, {x.max, i, z});
  painter.SetColor({0, 0, 255, 255});
  step = std::max(step, 1.0);
  for (double i = std::ceil(x.min / step) * step; i <= x.max; i += step)
    painter.Text({i, 0, z}, Number(i, text, sizeof text));
  for (double i = std::ceil(y.min / step) * step; i <= y.max; i += step)
    if (i != 0) painter.Text({0, i, z}, Number(i, text, sizeof text));
}

void DrawRaster(const Model& model, const Pose& global, Painting* marks, Painting* over) {
  const Model::Raster* raster = model.last_raster();
  if (!raster) return;
  constexpr double kAbove = 0.01;
  const Size size = model.GetGeom().size;
  const double z = size.z + kAbove;
  Painter painter(marks), labels(over);
  painter.SetFrame(BodyFrame(model, global));
  for (unsigned row = 0; row < raster->height; row++)
    for (unsigned column = 0; column < raster->width; column++) {
      if (!raster->cells[size_t{row} * raster->width + column]) continue;
      const double x = column * raster->cellwidth - size.x / 2;
      const double y = row * raster->cellheight - size.y / 2;
      const Bounds bx(x, x + raster->cellwidth), by(y, y + raster->cellheight);
      painter.SetColor(kBlack.WithOpacity(0.4));
      painter.Rectangle(bx, by, z);
      painter.SetColor(kBlack);
      painter.RectangleOutline(bx, by, z);
    }
  labels.SetFrame(painter.frame());
  labels.SetColor({255, 0, 0, 255});
  painter.SetColor({255, 0, 0, 255});
  char text[64];
  for (const auto& block : model.body().blocks())
    for (const point_t& p : block->points()) {
      painter.Point(p.x, p.y, z);
      const int length = std::snprintf(text, sizeof text, "%.2f %.2f", p.x, p.y);
      labels.Text({p.x, p.y, z}, std::string_view(text, static_cast<size_t>(length)));
    }
  const int length = std::snprintf(text, sizeof text, "[%u x %u]", raster->width, raster->height);
  labels.SetColor(kBlack);
  labels.Text({0, 0, z}, std::string_view(text, static_cast<size_t>(length)));
}

void DrawDissipation(const DissipationVis& heat, Painting* painting) {
  const double max_value = heat.Greatest();
  if (!(max_value > 0)) return;
  Painter painter(painting);
  for (const auto& [square, amount] : heat.squares()) {
    painter.SetColor({255, 0, 0, ColorByte(amount / max_value)});
    painter.Rectangle(Bounds(square.x, square.x + 1.0), Bounds(square.y, square.y + 1.0), 0);
  }
}

double AxisStep(double pixels_per_metre) {
  constexpr double kMinSpacing = 40;  // minimum distance between numbers, pixels
  const double min_value = kMinSpacing / std::max(pixels_per_metre, 1e-6);
  for (double power = 1;; power *= 10)
    for (const double digit : {1.0, 2.0, 5.0})
      if (digit * power >= min_value) return digit * power;
}

void DrawAxisNumbers(const Bounds& x, const Bounds& y, double step,
                     const view::Projection& projection, Painting* painting) {
  Painter painter(painting);
  painter.SetColor(kDarkGrey);
  char text[32];
  const auto put = [&](double px, double py, double value) {
    if (projection.Sees(px, py, 0, step))
      painter.Text({px, py, 0}, Number(value, text, sizeof text));
  };
  const auto count = [&](const Bounds& b) {
    return std::min(1e4, std::floor(std::max(b.max, -b.min) / step));
  };
  put(0, 0, 0);
  for (double i = 1, max_count = count(x); i <= max_count; i++) {
    if (i * step <= x.max) put(i * step, 0, i * step);
    if (-i * step >= x.min) put(-i * step, 0, -i * step);
  }
  for (double i = 1, max_count = count(y); i <= max_count; i++) {
    if (i * step <= y.max) put(0, i * step, i * step);
    if (-i * step >= y.min) put(0, -i * step, -i * step);
  }
}

}  // namespace Stg::draw
