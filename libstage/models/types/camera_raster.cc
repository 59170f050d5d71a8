// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/camera_raster.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"

namespace Stg::camera {

namespace {

constexpr Rgba kBackground{178, 178, 204, 255};

/// Below this value, the tilted view covers nearly all headings and is not bounded by a wedge.
constexpr double kSteep = 1e-3;

enum Side : unsigned { kLeft = 1, kRight = 2, kFar = 4 };

/// Index of the first pixel in [0, limit) with its centre at `at` or beyond, or `limit`.
int FirstPixel(double at, int limit) {
  const double pixel = std::ceil(at - 0.5);
  if (!(pixel > 0)) return 0;
  return pixel < limit ? static_cast<int>(pixel) : limit;
}

}  // namespace

void Raster::Begin(const Lens& lens, int width, int height, float* depth, Rgba* color) {
  lens_ = lens;
  width_ = width;
  height_ = height;
  depth_ = depth;
  color_ = color;
  nothing_ = static_cast<float>(1.0 / lens.far);
  const size_t count = static_cast<size_t>(width) * static_cast<size_t>(height);
  std::fill_n(depth, count, nothing_);
  std::fill_n(color, count, kBackground);
  first_of_row_.assign(static_cast<size_t>(height), -1);
  first_row_ = height;
  end_row_ = 0;

  const SineCosine view = SinCos(lens.eye.a), tilt = SinCos(lens.tilt);
  view_cosine_ = view.cosine;
  view_sine_ = view.sine;
  tilt_cosine_ = tilt.cosine;
  tilt_sine_ = tilt.sine;

  // A visible point at depth d lies d (cos t + v sin t) ahead, |v| <= half_height, and at most d
  // half_width to the side.
  const double spread = lens.half_height * std::fabs(tilt.sine);
  const double least = tilt.cosine - spread;
  wedge_ = least > kSteep ? lens.half_width / least : -1;
  wedge_scale_ = std::sqrt(1 + wedge_ * wedge_);
  ahead_limit_ = lens.far * std::max(0.0, tilt.cosine + spread);
  const double corner =
      std::sqrt(1 + lens.half_width * lens.half_width + lens.half_height * lens.half_height);
  reach_ = lens.far * corner;
  near_reach_ = lens.near * corner;
}

bool Raster::MayShow(double x, double y, double radius) const {
  const double dx = x - lens_.eye.x, dy = y - lens_.eye.y;
  const double limit = reach_ + radius;
  if (dx * dx + dy * dy > limit * limit) return false;
  if (wedge_ < 0) return true;
  const double ahead = dx * view_cosine_ + dy * view_sine_;
  const double right = dx * view_sine_ - dy * view_cosine_;
  return ahead <= ahead_limit_ + radius &&
         std::fabs(right) - ahead * wedge_ <= radius * wedge_scale_;
}

bool Raster::MayBeCut(double x, double y, double radius) const {
  const double dx = x - lens_.eye.x, dy = y - lens_.eye.y;
  const double limit = near_reach_ + radius;
  return dx * dx + dy * dy <= limit * limit;
}

unsigned Raster::Beyond(double right, double ahead) const {
  if (wedge_ < 0) return 0;
  const double side = ahead * wedge_;
  return (right < -side ? kLeft : 0u) | (right > side ? kRight : 0u) |
         (ahead > ahead_limit_ ? kFar : 0u);
}

void Raster::PlaceCorners(const std::vector<point_t>& outline, const Pose& frame) {
  const SineCosine turn = SinCos(frame.a);
  const double dx = frame.x - lens_.eye.x, dy = frame.y - lens_.eye.y;
  const double ahead = dx * view_cosine_ + dy * view_sine_;
  const double right = dx * view_sine_ - dy * view_cosine_;
  // Cosine and sine of the view's heading relative to the frame.
  const double cosine = turn.cosine * view_cosine_ + turn.sine * view_sine_;
  const double sine = turn.cosine * view_sine_ - turn.sine * view_cosine_;
  corners_.clear();
  for (const point_t& p : outline) {
    Corner corner{right + (p.x * sine - p.y * cosine), ahead + (p.x * cosine + p.y * sine), 0};
    corner.beyond = Beyond(corner.right, corner.ahead);
    corners_.push_back(corner);
  }
}

Raster::Point Raster::At(const Corner& corner, double height) const {
  return {corner.right, corner.ahead * tilt_sine_ + height * tilt_cosine_,
          corner.ahead * tilt_cosine_ - height * tilt_sine_};
}

/// Returns the plane of the points p with (right, up, depth) * p = product.
Raster::Plane Raster::MakePlane(double right, double up, double depth, double product) const {
  const double x = right * lens_.half_width, y = up * lens_.half_height;
  return {(depth - x - y) / product, 2 * x / (product * width_), 2 * y / (product * height_)};
}

// ---- faces --------------------------------------------------------------------------------------

void Raster::DrawWalls(const std::vector<point_t>& outline, const Pose& frame, const Bounds& z,
                       Rgba color) {
  PlaceCorners(outline, frame);
  const double low = z.min - lens_.eye.z, high = z.max - lens_.eye.z;
  const size_t count = corners_.size();
  for (size_t i = 0; i < count; i++) {
    const Corner &a = corners_[i], &b = corners_[i + 1 < count ? i + 1 : 0];
    if (a.beyond & b.beyond) continue;
    // The normal is horizontal: `right` to the right and `ahead` ahead.
    const double right = b.ahead - a.ahead, ahead = a.right - b.right;
    const double product = right * a.right + ahead * a.ahead;
    if (product == 0) continue;  // seen edge-on, or no wall at all
    polygon_.assign({At(a, low), At(b, low), At(b, high), At(a, high)});
    AddPolygon();
    Fill(MakePlane(right, ahead * tilt_sine_, ahead * tilt_cosine_, product), color);
  }
}

void Raster::AddOutline(const std::vector<point_t>& outline, const Pose& frame, double z) {
  PlaceCorners(outline, frame);
  unsigned beyond = ~0u;
  for (const Corner& corner : corners_) beyond &= corner.beyond;
  if (beyond) return;
  polygon_.clear();
  for (const Corner& corner : corners_) polygon_.push_back(At(corner, z - lens_.eye.z));
  AddPolygon();
}

void Raster::FillOutlines(double z, Rgba color) {
  Fill(MakePlane(0, tilt_cosine_, -tilt_sine_, z - lens_.eye.z), color);
}

// ---- polygons -----------------------------------------------------------------------------------

void Raster::AddPolygon() {
  size_t in_front = 0, beyond_far = 0;
  for (const Point& p : polygon_) {
    in_front += p.depth >= lens_.near;
    beyond_far += p.depth > lens_.far;
  }
  const size_t count = polygon_.size();
  if (in_front == 0 || beyond_far == count) return;
  if (in_front < count) ClipToNear();
  for (Point& p : polygon_) {
    p.right = (p.right / (p.depth * lens_.half_width) + 1) * 0.5 * width_;
    p.up = (p.up / (p.depth * lens_.half_height) + 1) * 0.5 * height_;
  }
  for (size_t i = 0; i < polygon_.size(); i++)
    AddEdge(polygon_[i], polygon_[i + 1 < polygon_.size() ? i + 1 : 0]);
}

/// Clips the polygon to the near plane (Sutherland-Hodgman).
void Raster::ClipToNear() {
  clipped_.clear();
  const double near = lens_.near;
  for (size_t i = 0; i < polygon_.size(); i++) {
    const Point &a = polygon_[i], &b = polygon_[i + 1 < polygon_.size() ? i + 1 : 0];
    const bool keep_a = a.depth >= near, keep_b = b.depth >= near;
    if (keep_a) clipped_.push_back(a);
    if (keep_a == keep_b) continue;
    // Starts at the kept end: faces that share the edge then compute bit-equal points.
    const Point &stays = keep_a ? a : b, &goes = keep_a ? b : a;
    const double fraction = (stays.depth - near) / (stays.depth - goes.depth);
    clipped_.push_back({stays.right + (goes.right - stays.right) * fraction,
                        stays.up + (goes.up - stays.up) * fraction, near});
  }
  polygon_.swap(clipped_);
}

/// Adds the crossings of an edge with pixel rows; `right` and `up` are in pixels here.
void Raster::AddEdge(const Point& from, const Point& to) {
  const bool upwards = from.up < to.up;
  // Always starts at the lower end, so that adjacent faces agree on their common edge.
  const Point &low = upwards ? from : to, &high = upwards ? to : from;
  const int begin = FirstPixel(low.up, height_), end = FirstPixel(high.up, height_);
  if (begin >= end) return;
  first_row_ = std::min(first_row_, begin);
  end_row_ = std::max(end_row_, end);
  const double slope = (high.right - low.right) / (high.up - low.up);
  for (int row = begin; row < end; row++) {
    STAGE_ASSERT(row >= 0 && row < height_);
    int& first = first_of_row_[static_cast<size_t>(row)];
    const double x = low.right + (row + 0.5 - low.up) * slope;
    crossings_.push_back({x, upwards ? 1 : -1, first});
    first = static_cast<int>(crossings_.size()) - 1;
  }
}

/// Fills the added polygons and removes them.
void Raster::Fill(const Plane& plane, Rgba color) {
  for (int row = first_row_; row < end_row_; row++) FillRow(row, plane, color);
  crossings_.clear();
  first_row_ = height_;
  end_row_ = 0;
}

void Raster::FillRow(int row, const Plane& plane, Rgba color) {
  int& first = first_of_row_[static_cast<size_t>(row)];
  row_.clear();
  for (int i = first; i >= 0; i = crossings_[static_cast<size_t>(i)].next)
    row_.push_back(crossings_[static_cast<size_t>(i)]);
  first = -1;
  std::sort(row_.begin(), row_.end(),
            [](const Crossing& a, const Crossing& b) { return a.x < b.x; });
  int winding = 0;
  for (size_t i = 0; i + 1 < row_.size(); i++) {
    winding += row_[i].direction;
    if (winding != 0) FillSpan(row, row_[i].x, row_[i + 1].x, plane, color);
  }
}

void Raster::FillSpan(int row, double from, double to, const Plane& plane, Rgba color) {
  const int begin = FirstPixel(from, width_), end = FirstPixel(to, width_);
  STAGE_ASSERT(begin >= 0 && end <= width_ && row >= 0 && row < height_);
  const double in_row = plane.constant + plane.y * (row + 0.5);
  const size_t offset = static_cast<size_t>(row) * static_cast<size_t>(width_);
  float* depth = depth_ + offset;
  Rgba* pixel = color_ + offset;
  for (int i = begin; i < end; i++) {
    const float nearness = static_cast<float>(in_row + plane.x * (i + 0.5));
    if (!(nearness > depth[i])) continue;
    depth[i] = nearness;
    pixel[i] = color;
  }
}

void Raster::Finish() {
  const size_t count = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  const float far = static_cast<float>(lens_.far);
  for (size_t i = 0; i < count; i++) depth_[i] = depth_[i] > nothing_ ? 1.0f / depth_[i] : far;
}

}  // namespace Stg::camera
