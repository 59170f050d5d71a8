// SPDX-License-Identifier: GPL-2.0-or-later
// The camera's rasterizer gives the same depths as rays through the pixels.
#include "models/types/camera_raster.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace Stg {
namespace {

constexpr int kWidth = 37, kHeight = 23;
constexpr double kRadius = 0.7072;  // radius of the box's circumscribed circle, rounded up

/// A square box of 1 m with a random pose and height range, and a camera that looks at it.
struct Scene {
  camera::Lens lens;
  Pose frame;
  Bounds z;
};

class SceneSource {
 public:
  Scene Next() {
    Scene scene;
    camera::Lens& lens = scene.lens;
    lens.eye = Pose(Draw(-5, 5), Draw(-5, 5), Draw(0, 3), Draw(-4, 4));
    lens.tilt = Draw(-1.5, 1.5);
    lens.half_width = Draw(0.2, 2);
    lens.half_height = Draw(0.2, 2);
    lens.near = Draw(0.05, 0.5);
    lens.far = Draw(2, 10);
    scene.frame = Pose(Draw(-3, 3), Draw(-3, 3), 0, Draw(-4, 4));
    scene.z = Bounds(Draw(-1, 1), Draw(1, 3));
    return scene;
  }

 private:
  double Draw(double from, double to) {
    state_ = state_ * 1664525u + 1013904223u;
    return from + (to - from) * (state_ >> 8) / 16777216.0;
  }
  unsigned state_ = 7;
};

void Draw(const Scene& scene, camera::Raster* raster) {
  const std::vector<point_t> outline{{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  const camera::Rgba paint{1, 2, 3, 255};
  raster->DrawWalls(outline, scene.frame, scene.z, paint);
  const bool cut = raster->MayBeCut(scene.frame.x, scene.frame.y, kRadius);
  if (raster->IsBelowEye(scene.z.max) || cut) {
    raster->AddOutline(outline, scene.frame, scene.z.max);
    raster->FillOutlines(scene.z.max, paint);
  }
  if (raster->IsAboveEye(scene.z.min) || cut) {
    raster->AddOutline(outline, scene.frame, scene.z.min);
    raster->FillOutlines(scene.z.min, paint);
  }
  raster->Finish();
}

/// The depth at which the ray through the center of a pixel hits the box, beyond the near plane; no
/// value if rounding could decide.
std::optional<double> ExpectedDepth(const Scene& scene, int i, int j) {
  const camera::Lens& lens = scene.lens;
  const double u = ((i + 0.5) / kWidth * 2 - 1) * lens.half_width;
  const double v = ((j + 0.5) / kHeight * 2 - 1) * lens.half_height;
  // Transform the ray at depth 1 to the world frame, then to the frame of the box.
  const double ca = std::cos(lens.eye.a), sa = std::sin(lens.eye.a);
  const double ct = std::cos(lens.tilt), st = std::sin(lens.tilt);
  const double ahead = ct + v * st, up = v * ct - st;
  const double wx = ahead * ca + u * sa, wy = ahead * sa - u * ca;
  const double cf = std::cos(scene.frame.a), sf = std::sin(scene.frame.a);
  const double dx = lens.eye.x - scene.frame.x, dy = lens.eye.y - scene.frame.y;
  const double origin[3] = {dx * cf + dy * sf, -dx * sf + dy * cf, lens.eye.z};
  const double along[3] = {wx * cf + wy * sf, -wx * sf + wy * cf, up};
  const double low[3] = {-0.5, -0.5, scene.z.min}, high[3] = {0.5, 0.5, scene.z.max};
  double enter = -1e9, leave = 1e9;
  for (int axis = 0; axis < 3; axis++) {
    const double a = (low[axis] - origin[axis]) / along[axis];
    const double b = (high[axis] - origin[axis]) / along[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  for (const double close : {enter - leave, enter - lens.near, leave - lens.near})
    if (std::fabs(close) < 1e-6) return std::nullopt;
  if (enter > leave || leave < lens.near) return lens.far;
  return std::min(enter > lens.near ? enter : leave, lens.far);
}

TEST(RasterTest, EveryPixelAgreesWithItsRay) {
  std::vector<float> depth(kWidth * kHeight);
  std::vector<camera::Rgba> color(kWidth * kHeight);
  camera::Raster raster;
  SceneSource source;
  int seen = 0;
  for (int round = 0; round < 1000; round++) {
    const Scene scene = source.Next();
    raster.Begin(scene.lens, kWidth, kHeight, depth.data(), color.data());
    const bool may_show = raster.MayShow(scene.frame.x, scene.frame.y, kRadius);
    Draw(scene, &raster);
    for (int j = 0; j < kHeight; j++) {
      for (int i = 0; i < kWidth; i++) {
        const auto expected = ExpectedDepth(scene, i, j);
        if (!expected) continue;
        const size_t pixel = static_cast<size_t>(i + j * kWidth);
        ASSERT_NEAR(static_cast<double>(depth[pixel]), *expected, 1e-4 * *expected)
            << "round " << round << ", pixel " << i << ", " << j;
        if (*expected > scene.lens.far - 1e-5) continue;
        seen++;
        ASSERT_TRUE(may_show) << round;
        ASSERT_EQ(color[pixel].b, 3);
      }
    }
  }
  EXPECT_GT(seen, 10000);
}

}  // namespace
}  // namespace Stg
