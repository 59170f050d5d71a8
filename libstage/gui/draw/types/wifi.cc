// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws a wifi device's range and its links.

#include "models/wifi.hh"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"
#include "models/body.hh"
#include "models/line_in_bodies.hh"
#include "world/world.hh"

namespace Stg::draw {

namespace {

/// Distance at which the signal falls to range_db, or the range of a simple device. Ignores walls
/// and random errors. Metres.
double Radius(const ModelWifi& wifi) {
  const double frequency = 20 * std::log10(wifi.freq), gain = wifi.power - wifi.range_db;
  switch (wifi.propagation) {
    case ModelWifi::PROPAGATION_SIMPLE:
      return wifi.range;
    case ModelWifi::PROPAGATION_FRIIS:
      return 1000 * std::pow(10, (gain - 32.44177 - frequency) / 20);
    case ModelWifi::PROPAGATION_ITU_INDOOR:
    case ModelWifi::PROPAGATION_RAYTRACE:
      return std::pow(10, (gain + 28 - frequency) / wifi.plc);
    case ModelWifi::PROPAGATION_LOG_DISTANCE:
      return std::pow(10, (gain - (frequency + 32.44177 - 60)) / (10 * wifi.ple));
    case ModelWifi::PROPAGATION_NONE:
      break;
  }
  return 0;
}

/// Range of a device whose signal is attenuated by bodies: one radius for each of many directions.
class WalledRange {
 public:
  static constexpr size_t kCorners = 72;

  WalledRange(const ModelWifi& wifi, const Pose& global, double radius)
      : wifi_(wifi), global_(global), radius_(radius) {
    for (const Model* model : wifi.GetWorld()->GetChildren()) Collect(*model);
  }

  std::array<point3_t, kCorners> Corners() {
    std::array<point3_t, kCorners> corners;
    for (size_t i = 0; i < kCorners; i++) {
      const double heading = 2 * M_PI * static_cast<double>(i) / kCorners;
      const double reach = Reach(std::cos(heading), std::sin(heading));
      corners[i] = point3_t(reach * std::cos(heading), reach * std::sin(heading), 0);
    }
    return corners;
  }

 private:
  /// Collects obstacles as links do: what rangers can see, except the device's own robot.
  void Collect(const Model& model) {
    if (model.IsRelated(&wifi_)) return;
    if (model.vis.ranger_return >= 0 && !model.body().empty()) {
      const Pose place = model.GetGlobalPose();
      const Size size = model.GetGeom().size;
      const Pose offset = model.GetGeom().pose;
      const double around = std::hypot(size.x, size.y) / 2 + std::hypot(offset.x, offset.y);
      if (std::hypot(place.x - global_.x, place.y - global_.y) < radius_ + around)
        obstacles_.push_back(&model);
    }
    for (const Model* child : model.GetChildren()) Collect(*child);
  }

  /// Distance that the signal reaches in this direction, in metres. Shortens the path beyond the
  /// first obstacle by the ratio of the open-air loss to the total loss. o is the distance to that
  /// obstacle, w the total length inside obstacles, in metres.
  double Reach(double cosine, double sine) {
    constexpr double kNearest = 0.01;          // m
    constexpr double kDecibelsPerMetre = 100;  // loss inside obstacles, to be multiplied by the
                                               // wall factor
    const point3_t here(global_.x, global_.y, global_.z);
    line_.Begin(here, point3_t(here.x + radius_ * cosine, here.y + radius_ * sine, here.z));
    for (const Model* obstacle : obstacles_) line_.AddBodyOf(*obstacle);
    const double w = line_.FractionInside() * radius_;
    if (!(w > 0)) return radius_;
    const double o = std::min(std::max(line_.FirstInside() * radius_, kNearest), radius_);
    const double open_loss = wifi_.plc * std::log10(radius_ / o);
    const double all_loss = open_loss + wifi_.wall_factor * kDecibelsPerMetre * w;
    return all_loss > 0 ? o + (radius_ - o) * std::clamp(open_loss / all_loss, 0.0, 1.0) : radius_;
  }

  const ModelWifi& wifi_;
  const Pose global_;
  const double radius_;
  std::vector<const Model*> obstacles_;
  LineInBodies line_;
};

/// Draws on the floor in a light colour, because ranges may overlap and cover the whole world.
void DrawRange(const ModelWifi& wifi, const Pose& global, Painting* floor) {
  constexpr Rgba kFill = {0xc1, 0xff, 0xc1, 38}, kOutline = {0x2e, 0x8b, 0x57, 255};
  const double exact = Radius(wifi);
  const double radius = std::isfinite(exact) ? std::min(exact, kMaxDrawnLength) : kMaxDrawnLength;
  Painter painter(floor);
  painter.SetFrame(Pose(global.x, global.y, 0, 0));
  if (wifi.propagation != ModelWifi::PROPAGATION_RAYTRACE) {
    painter.SetColor(kFill);
    painter.Sector(radius, 0, 2 * M_PI, 0);
    painter.SetColor(kOutline);
    painter.SectorOutline(radius, 0, 2 * M_PI, 0, false);
    return;
  }
  const auto corners = WalledRange(wifi, global, radius).Corners();
  for (size_t i = 0; i < corners.size(); i++) {
    const point3_t& next = corners[(i + 1) % corners.size()];
    painter.SetColor(kFill);
    painter.Triangle({0, 0, 0}, corners[i], next);
    painter.SetColor(kOutline);
    painter.Line(corners[i], next);
  }
}

void DrawWifi(const ModelWifi& wifi, const Pose& global, const Layers& layers) {
  constexpr double kShort = 0.2, kHead = 0.15;
  DrawRange(wifi, global, layers.floor);
  Painter painter(layers.data);
  painter.SetColor({65, 105, 225, 255});
  for (const ModelWifi::Neighbor& neighbor : wifi.GetNeighbors()) {
    const double dx = neighbor.pose.x - global.x, dy = neighbor.pose.y - global.y;
    const double length = std::hypot(dx, dy) - kShort;
    if (!(length > 0)) continue;
    painter.SetFrame(Pose(global.x, global.y, global.z, std::atan2(dy, dx)));
    painter.Line({0, 0, 0}, {length, 0, 0}, true);
    painter.Line({length, 0, 0}, {length - kHead, kHead / 2, 0}, true);
    painter.Line({length, 0, 0}, {length - kHead, -kHead / 2, 0}, true);
  }
}

void Draw(ModelWifi& wifi, const Pose& global, const DataFrame& frame) {
  if (frame.options[view::Show::kWifi]) DrawWifi(wifi, global, frame.layers);
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelWifi>({view::Show::kWifi}, Draw));

}  // namespace

}  // namespace Stg::draw
