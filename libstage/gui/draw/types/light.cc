// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/light.hh"

#include <cmath>

#include "geometry/trigonometry.hh"
#include "gui/draw/light_picture.hh"
#include "gui/draw/type_picture.hh"
#include "models/types/glow.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr int kSides = 24;

struct Ring {
  double share;  ///< of the radius
  double opacity;
};
constexpr Ring kMiddle{0, kGlowMiddle}, kHalf{0.5, kGlowHalf}, kEdge{1, 0};

// A light has no data to draw: its body's colour and its glow show its state.
[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelLight>({Show::kBlink, Show::kLights}));

}  // namespace

void DrawGlow(const LightSource& light, Painting* painting) {
  const double radius = GlowRadius(light);
  if (radius == 0) return;
  const Model& model = light.model();
  const Pose place = model.GetGlobalPose() + model.GetGeom().pose;
  const double opacity = model.GetColor().a;
  const Rgba color = ToRgba(model.GetColor());
  const auto add = [&](const Ring& ring, int side) {
    const SineCosine turn = SinCos(2 * M_PI * side / kSides);
    const double distance = radius * ring.share;
    painting->triangles.push_back({static_cast<float>(place.x + distance * turn.cosine),
                                   static_cast<float>(place.y + distance * turn.sine), 0,
                                   color.WithOpacity(opacity * ring.opacity)});
  };
  const auto triangle = [&](const Ring& a, int i, const Ring& b, int j, const Ring& c, int k) {
    add(a, i);
    add(b, j);
    add(c, k);
  };
  for (int side = 0; side < kSides; side++) {
    triangle(kMiddle, side, kHalf, side, kHalf, side + 1);
    triangle(kHalf, side, kEdge, side, kEdge, side + 1);
    triangle(kHalf, side, kEdge, side + 1, kHalf, side + 1);
  }
}

}  // namespace Stg::draw
