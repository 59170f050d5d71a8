// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/view/projection.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"

namespace Stg::view {

namespace {

using Vector = std::array<double, 4>;

constexpr Matrix kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

Vector Apply(const Matrix& m, const Vector& v) {
  Vector out{};
  for (size_t row = 0; row < 4; row++)
    for (size_t column = 0; column < 4; column++) out[row] += m[column * 4 + row] * v[column];
  return out;
}

Matrix Translation(double x, double y, double z) {
  return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1};
}

Matrix TurnAboutX(double degrees) {
  const SineCosine turn = SinCos(dtor(degrees));
  return {1, 0, 0, 0, 0, turn.cosine, turn.sine, 0, 0, -turn.sine, turn.cosine, 0, 0, 0, 0, 1};
}

Matrix TurnAboutZ(double degrees) {
  const SineCosine turn = SinCos(dtor(degrees));
  return {turn.cosine, turn.sine, 0, 0, -turn.sine, turn.cosine, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
}

/// Returns the world-to-eye matrix. Pitch 0 looks down; with yaw 0, +y is up in the image.
Matrix LookFrom(const Camera& camera, double z) {
  return Multiply(Multiply(TurnAboutX(-camera.pitch()), TurnAboutZ(-camera.yaw())),
                  Translation(-camera.x(), -camera.y(), -z));
}

/// Distance from (x, y, 0) to the farthest corner of the box.
double Reach(const bounds3d_t& box, double x, double y) {
  const auto farthest = [](const Bounds& b, double from) {
    return std::max(std::fabs(b.min - from), std::fabs(b.max - from));
  };
  return std::hypot(std::hypot(farthest(box.x, x), farthest(box.y, y)), farthest(box.z, 0));
}

Matrix FlatLens(const OrthoCamera& camera, int width, int height, const bounds3d_t& reach) {
  Matrix m = kIdentity;
  m[0] = 2 * camera.scale() / width;
  m[5] = 2 * camera.scale() / height;
  m[10] = -1 / (Reach(reach, camera.x(), camera.y()) + 10);
  return m;
}

Matrix PerspectiveLens(const PerspectiveCamera& camera, int width, int height) {
  const double half_height = std::tan(dtor(camera.vertFov()) / 2);
  const double half_width = std::tan(dtor(camera.horizFov()) / 2) * width / height;
  const double near = camera.nearClip(), far = camera.farClip();
  return {1 / half_width,
          0,
          0,
          0,
          0,
          1 / half_height,
          0,
          0,
          0,
          0,
          -(far + near) / (far - near),
          -1,
          0,
          0,
          -2 * far * near / (far - near),
          0};
}

/// Gauss-Jordan elimination with pivoting. A camera's matrix is always invertible.
Matrix Invert(Matrix m) {
  Matrix inverse = kIdentity;
  const auto at = [](Matrix& a, size_t row, size_t column) -> double& {
    return a[column * 4 + row];
  };
  for (size_t i = 0; i < 4; i++) {
    size_t pivot = i;
    for (size_t row = i + 1; row < 4; row++)
      if (std::fabs(at(m, row, i)) > std::fabs(at(m, pivot, i))) pivot = row;
    for (size_t column = 0; column < 4; column++) {
      std::swap(at(m, i, column), at(m, pivot, column));
      std::swap(at(inverse, i, column), at(inverse, pivot, column));
    }
    const double scale = 1 / at(m, i, i);
    for (size_t column = 0; column < 4; column++) {
      at(m, i, column) *= scale;
      at(inverse, i, column) *= scale;
    }
    for (size_t row = 0; row < 4; row++) {
      const double factor = row == i ? 0 : at(m, row, i);
      for (size_t column = 0; column < 4; column++) {
        at(m, row, column) -= factor * at(m, i, column);
        at(inverse, row, column) -= factor * at(inverse, i, column);
      }
    }
  }
  return inverse;
}

point3_t Point(const Vector& v) { return point3_t(v[0] / v[3], v[1] / v[3], v[2] / v[3]); }

}  // namespace

Matrix Multiply(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (size_t column = 0; column < 4; column++)
    for (size_t row = 0; row < 4; row++)
      for (size_t k = 0; k < 4; k++) out[column * 4 + row] += a[k * 4 + row] * b[column * 4 + k];
  return out;
}

Projection::Projection(const ViewState& view, int width, int height, const bounds3d_t& reach)
    : width_(std::max(width, 1)), height_(std::max(height, 1)) {
  if (view.is_perspective()) {
    projection_ = PerspectiveLens(view.perspective, width_, height_);
    modelview_ = LookFrom(view.perspective, view.perspective.z());
  } else {
    projection_ = FlatLens(view.flat, width_, height_, reach);
    modelview_ = LookFrom(view.flat, 0);
  }
  world_to_clip_ = Multiply(projection_, modelview_);
  inverse_ = Invert(world_to_clip_);
  MakePlanes();
}

/// A point is visible if -w <= x, y, z <= w in clip coordinates: six sums must not be negative.
void Projection::MakePlanes() {
  for (size_t i = 0; i < 6; i++) {
    const double sign = i % 2 == 0 ? 1 : -1;
    double sum[4];
    for (size_t column = 0; column < 4; column++)
      sum[column] = world_to_clip_[column * 4 + 3] + sign * world_to_clip_[column * 4 + i / 2];
    const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    planes_[i] = {sum[0] / length, sum[1] / length, sum[2] / length, sum[3] / length};
  }
}

std::optional<point3_t> Projection::ToPixels(const point3_t& point) const {
  const Vector clip = Apply(world_to_clip_, {point.x, point.y, point.z, 1});
  if (!(clip[3] > 0)) return std::nullopt;
  return point3_t((clip[0] / clip[3] + 1) / 2 * width_, (clip[1] / clip[3] + 1) / 2 * height_,
                  (clip[2] / clip[3] + 1) / 2);
}

Projection::LineOfSight Projection::LineOfSightAt(double x, double y_from_top) const {
  const double cx = 2 * x / width_ - 1, cy = 1 - 2 * y_from_top / height_;
  return {Point(Apply(inverse_, {cx, cy, -1, 1})), Point(Apply(inverse_, {cx, cy, 1, 1}))};
}

std::optional<point_t> Projection::FloorPoint(double x, double y_from_top, double z) const {
  const LineOfSight sight = LineOfSightAt(x, y_from_top);
  const double drop = sight.to.z - sight.from.z;
  if (std::fabs(drop) < 1e-9) return std::nullopt;
  const double fraction = (z - sight.from.z) / drop;
  // The orthographic camera has no eye point, so intersections in front of the near plane count.
  const bool has_eye = projection_[11] != 0;
  if (!std::isfinite(fraction) || (has_eye && fraction < 0)) return std::nullopt;
  return point_t(sight.from.x + fraction * (sight.to.x - sight.from.x),
                 sight.from.y + fraction * (sight.to.y - sight.from.y));
}

double Projection::PixelAt(const point3_t& point) const {
  const Vector clip = Apply(world_to_clip_, {point.x, point.y, point.z, 1});
  return 2 * std::max(clip[3], 1e-6) / (projection_[5] * height_);
}

}  // namespace Stg::view
