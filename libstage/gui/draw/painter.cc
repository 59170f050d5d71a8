// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/painter.hh"

#include <algorithm>
#include <cmath>

namespace Stg::draw {

namespace {

constexpr double kArcStep = M_PI / 36;
constexpr double kMaxDashes = 1000;

int StepsOf(double angle) {
  return std::clamp(static_cast<int>(std::ceil(std::fabs(angle) / kArcStep)), 1, 1000);
}

}  // namespace

void Painter::SetFrame(const Pose& frame) {
  frame_ = frame;
  turn_ = SinCos(frame.a);
}

Vertex Painter::At(double x, double y, double z) const {
  return {static_cast<float>(frame_.x + x * turn_.cosine - y * turn_.sine),
          static_cast<float>(frame_.y + x * turn_.sine + y * turn_.cosine),
          static_cast<float>(frame_.z + z), color_};
}

void Painter::Point(double x, double y, double z) { painting_.points.push_back(At(x, y, z)); }

void Painter::Line(const point3_t& from, const point3_t& to, bool thick) {
  std::vector<Vertex>& lines = thick ? painting_.thick_lines : painting_.lines;
  lines.push_back(At(from));
  lines.push_back(At(to));
}

void Painter::DashedLine(const point3_t& from, const point3_t& to, double dash) {
  const double length = std::hypot(std::hypot(to.x - from.x, to.y - from.y), to.z - from.z);
  if (!std::isfinite(length) || length <= 0) return;
  const double step = std::max(2 * dash, length / kMaxDashes);
  for (double s = 0; s < length; s += step)
    Line(Between(from, to, s / length), Between(from, to, std::min(s + step / 2, length) / length),
         true);
}

void Painter::Triangle(const point3_t& a, const point3_t& b, const point3_t& c) {
  painting_.triangles.push_back(At(a));
  painting_.triangles.push_back(At(b));
  painting_.triangles.push_back(At(c));
}

void Painter::Quad(const point3_t& a, const point3_t& b, const point3_t& c, const point3_t& d) {
  Triangle(a, b, c);
  Triangle(a, c, d);
}

void Painter::Rectangle(const Bounds& x, const Bounds& y, double z) {
  Quad({x.min, y.min, z}, {x.max, y.min, z}, {x.max, y.max, z}, {x.min, y.max, z});
}

void Painter::RectangleOutline(const Bounds& x, const Bounds& y, double z, bool thick) {
  Line({x.min, y.min, z}, {x.max, y.min, z}, thick);
  Line({x.max, y.min, z}, {x.max, y.max, z}, thick);
  Line({x.max, y.max, z}, {x.min, y.max, z}, thick);
  Line({x.min, y.max, z}, {x.min, y.min, z}, thick);
}

void Painter::Sector(double radius, double from, double angle, double z) {
  const int steps = StepsOf(angle);
  const auto on_arc = [&](int i) {
    const SineCosine turn = SinCos(from + angle * i / steps);
    return point3_t(radius * turn.cosine, radius * turn.sine, z);
  };
  for (int i = 0; i < steps; i++) Triangle({0, 0, z}, on_arc(i), on_arc(i + 1));
}

void Painter::SectorOutline(double radius, double from, double angle, double z, bool to_centre) {
  const int steps = StepsOf(angle);
  point3_t last(0, 0, z);
  for (int i = 0; i <= steps; i++) {
    const SineCosine turn = SinCos(from + angle * i / steps);
    const point3_t next(radius * turn.cosine, radius * turn.sine, z);
    if (i > 0 || to_centre) Line(last, next);
    last = next;
  }
  if (to_centre) Line(last, {0, 0, z});
}

void Painter::Text(const point3_t& at, std::string_view text, Align align, LabelKind kind) {
  if (text.empty()) return;
  const Vertex v = At(at);
  painting_.labels.push_back({v.x, v.y, v.z, color_,
                              static_cast<uint32_t>(painting_.letters.size()),
                              static_cast<uint32_t>(text.size()), align, kind});
  painting_.letters += text;
}

}  // namespace Stg::draw
