// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/logo.hh"

#include <FL/fl_draw.H>

#include <algorithm>
#include <cmath>
#include <utility>

namespace Stg::internal::window {

namespace {

struct Spot {
  double x, y;
};

// Pixels from the robot's centre, x to the right and y up.
constexpr int kRobotX = 22, kRobotY = 48, kPictureWidth = 112;
constexpr double kTurn = 8 * M_PI / 180, kFieldOfView = 2.2, kReach = 82;
constexpr int kGap = 8;       // between picture and name, pixels
constexpr double kSize = 28;  // pixels for one unit of the robot's outline

// An explorer, the robot of the example worlds: base and turret.
constexpr Spot kBase[] = {{0.5, -0.21}, {0.5, 0.21},   {0.21, 0.5},   {-0.21, 0.5},
                          {-0.5, 0.21}, {-0.5, -0.21}, {-0.21, -0.5}, {0.21, -0.5}};
constexpr Spot kTurret[] = {{0.4, 0}, {0.15, 0.3}, {-0.325, 0.225}, {-0.325, -0.225}, {0.15, -0.3}};
// A wall in front of the robot.
constexpr double kWallX = 52, kWallWidth = 9, kWallLow = -20, kWallHigh = 12;

/// Length of a ray in pixels.
double Range(double heading) {
  const double along = std::cos(heading), up = std::sin(heading);
  if (along > 0) {
    const double distance = kWallX / along;
    const double y = distance * up;
    if (distance < kReach && y >= kWallLow && y <= kWallHigh) return distance;
  }
  return kReach;
}

template <typename Spots>
void Area(const Spots& spots, Fl_Color fill, Fl_Color edge) {
  const auto corners = [&] {
    for (const Spot& spot : spots)
      fl_vertex(kSize * (spot.x * std::cos(kTurn) - spot.y * std::sin(kTurn)),
                -kSize * (spot.x * std::sin(kTurn) + spot.y * std::cos(kTurn)));
  };
  fl_color(fill);
  fl_begin_complex_polygon();
  corners();
  fl_end_complex_polygon();
  fl_color(edge);
  fl_begin_loop();
  corners();
  fl_end_loop();
}

void DrawFloor(int x, int y, int height) {
  constexpr int kSquare = 16;
  for (int row = 0; row * kSquare < height; row++)
    for (int column = 0; column * kSquare < kPictureWidth; column++) {
      fl_color((row + column) % 2 == 0 ? FL_WHITE : fl_rgb_color(235, 235, 250));
      fl_rectf(x + column * kSquare, y + row * kSquare,
               std::min(kSquare, kPictureWidth - column * kSquare),
               std::min(kSquare, height - row * kSquare));
    }
}

void DrawScan() {
  constexpr int kRays = 180;
  fl_color(fl_rgb_color(205, 212, 248));
  fl_begin_complex_polygon();
  fl_vertex(0, 0);
  for (int i = 0; i <= kRays; i++) {
    const double heading = kTurn + kFieldOfView * (static_cast<double>(i) / kRays - 0.5);
    fl_vertex(Range(heading) * std::cos(heading), -Range(heading) * std::sin(heading));
  }
  fl_end_complex_polygon();
}

}  // namespace

Logo::Logo(int x, int y, std::string name)
    : Fl_Widget(x, y, kWidth, kHeight), name_(std::move(name)) {}

void Logo::draw() {
  fl_push_clip(x(), y(), w(), h());
  fl_color(FL_WHITE);
  fl_rectf(x(), y(), w(), h());
  fl_push_clip(x(), y(), kPictureWidth, h());
  DrawFloor(x(), y(), h());
  fl_push_matrix();
  fl_translate(x() + kRobotX, y() + kRobotY);
  DrawScan();
  fl_color(fl_rgb_color(90, 90, 96));
  fl_rectf(x() + kRobotX + static_cast<int>(kWallX), y() + kRobotY - static_cast<int>(kWallHigh),
           static_cast<int>(kWallWidth), static_cast<int>(kWallHigh - kWallLow));
  const Fl_Color orange = fl_rgb_color(217, 115, 26), dark = fl_rgb_color(109, 58, 13);
  Area(kBase, orange, dark);
  Area(kTurret, orange, dark);
  fl_pop_matrix();
  fl_pop_clip();
  fl_color(fl_rgb_color(40, 40, 48));
  int size = 26;
  do fl_font(FL_HELVETICA_BOLD, size--);
  while (size > 8 && fl_width(name_.c_str()) > w() - kPictureWidth - 2 * kGap);
  fl_draw(name_.c_str(), x() + kPictureWidth, y(), w() - kPictureWidth, h(), FL_ALIGN_CENTER);
  fl_pop_clip();
}

}  // namespace Stg::internal::window
