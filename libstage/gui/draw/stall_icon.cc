// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/stall_icon.hh"

namespace Stg::draw {

namespace {

struct Spot {
  double x, y;
};

constexpr Rgba kYellow = {255, 211, 0, 255};
constexpr double kSide = 0.5;  // metres

// Coordinates are fractions of the side, from the centre. Later layers are nearer to the viewer.
constexpr Spot kBorder[] = {{-0.5, -0.44}, {0.5, -0.44}, {0.0, 0.5}};
constexpr Spot kFace[] = {{-0.40, -0.38}, {0.40, -0.38}, {0.0, 0.37}};
constexpr Spot kStroke[] = {{-0.035, -0.14}, {0.035, -0.14}, {0.06, 0.16},
                            {-0.035, -0.14}, {0.06, 0.16},   {-0.06, 0.16}};
constexpr Spot kDot[] = {{-0.05, -0.31}, {0.05, -0.31}, {0.05, -0.21},
                         {-0.05, -0.31}, {0.05, -0.21}, {-0.05, -0.21}};

}  // namespace

void AppendStallIcon(const point3_t& place, const view::Matrix& m, std::vector<Vertex>* triangles) {
  const auto add = [&](const auto& spots, const Rgba& color, double nearer) {
    for (const Spot& spot : spots) {
      const double x = spot.x * kSide, y = spot.y * kSide;
      triangles->push_back({static_cast<float>(place.x + x * m[0] + y * m[1] + nearer * m[2]),
                            static_cast<float>(place.y + x * m[4] + y * m[5] + nearer * m[6]),
                            static_cast<float>(place.z + x * m[8] + y * m[9] + nearer * m[10]),
                            color});
    }
  };
  add(kBorder, kBlack, 0);
  add(kFace, kYellow, 0.005);
  add(kStroke, kBlack, 0.01);
  add(kDot, kBlack, 0.01);
}

}  // namespace Stg::draw
