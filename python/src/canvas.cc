// SPDX-License-Identifier: GPL-2.0-or-later

#include "canvas.hh"

#include <algorithm>
#include <cmath>

#include "messages/assert.hh"
#include "pictures/color_byte.hh"

namespace Stg::python {

namespace {

constexpr int64_t kSubpixels = 64;      // subpixels per pixel
constexpr double kMaxPixels = 1 << 22;  // pixels; a product of two distances then fits an int64_t

int64_t DivideDown(int64_t dividend, int64_t divisor) {
  const int64_t quotient = dividend / divisor;
  return quotient - (dividend % divisor != 0 && (dividend < 0) != (divisor < 0) ? 1 : 0);
}

/// The first pixel whose center is at or after `place` (in subpixels).
int64_t FirstPixel(int64_t place) { return DivideDown(place + kSubpixels / 2 - 1, kSubpixels); }

/// Converts pixels to subpixels.
int64_t Round(double pixels) {
  if (std::isnan(pixels)) return 0;
  return static_cast<int64_t>(
      std::floor(std::clamp(pixels, -kMaxPixels, kMaxPixels) * double{kSubpixels} + 0.5));
}

}  // namespace

Canvas::Ink Canvas::Ink::Of(const Color& color) {
  return {ColorByte(color.r), ColorByte(color.g), ColorByte(color.b), ColorByte(color.a)};
}

Canvas::Ink Canvas::Ink::Darker() const {
  const auto less = [](uint8_t part) { return static_cast<uint8_t>(part * 3 / 5); };
  return {less(red), less(green), less(blue), opacity};
}

Canvas::Canvas(const View& view, uint8_t* pixels) : view_(view), pixels_(pixels) {}

void Canvas::Clear(const Ink& ink) {
  const size_t count = static_cast<size_t>(view_.width) * static_cast<size_t>(view_.height);
  for (size_t i = 0; i < count; i++) {
    pixels_[3 * i] = ink.red;
    pixels_[3 * i + 1] = ink.green;
    pixels_[3 * i + 2] = ink.blue;
  }
}

Canvas::Corner Canvas::Place(const point_t& point) const {
  return {Round((point.x - view_.x) * view_.scale + 0.5 * view_.width),
          Round(0.5 * view_.height - (point.y - view_.y) * view_.scale)};
}

void Canvas::Blend(int64_t column, int64_t row, const Ink& ink) {
  STAGE_ASSERT(column >= 0 && column < view_.width && row >= 0 && row < view_.height);
  uint8_t* const pixel = pixels_ + 3 * (row * view_.width + column);
  const auto mix = [&](uint8_t below, uint8_t above) {
    const int sum = below * (255 - ink.opacity) + above * ink.opacity;
    return static_cast<uint8_t>((sum + 127) / 255);
  };
  pixel[0] = mix(pixel[0], ink.red);
  pixel[1] = mix(pixel[1], ink.green);
  pixel[2] = mix(pixel[2], ink.blue);
}

/// Records where an edge crosses the center lines of rows. The interval of an edge includes its
/// upper end but not its lower one, so that each row crosses an outline an even number of times.
void Canvas::AddEdge(Corner from, Corner to) {
  if (from.y > to.y) std::swap(from, to);
  const int64_t first = std::max<int64_t>(0, FirstPixel(from.y));
  const int64_t end = std::min<int64_t>(view_.height, FirstPixel(to.y));
  for (int64_t row = first; row < end; row++) {
    const int64_t down = row * kSubpixels + kSubpixels / 2 - from.y;
    const int64_t x = from.x + DivideDown(down * (to.x - from.x), to.y - from.y);
    crossings_.push_back({static_cast<int32_t>(row), static_cast<int32_t>(FirstPixel(x))});
  }
}

void Canvas::AddOutline(const std::vector<point_t>& points) {
  if (points.size() < 2) return;
  Corner last = Place(points.back());
  for (const point_t& point : points) {
    const Corner next = Place(point);
    AddEdge(last, next);
    last = next;
  }
}

void Canvas::Fill(const Ink& ink) {
  std::sort(crossings_.begin(), crossings_.end());
  for (size_t i = 0; i + 1 < crossings_.size(); i += 2) {
    const int32_t end = std::min(crossings_[i + 1].column, view_.width);
    for (int32_t column = std::max(crossings_[i].column, 0); column < end; column++)
      Blend(column, crossings_[i].row, ink);
  }
  crossings_.clear();
}

void Canvas::DrawLine(const point_t& from, const point_t& to, const Ink& ink) {
  Corner a = Place(from), b = Place(to);
  const bool steep = std::abs(b.y - a.y) > std::abs(b.x - a.x);
  if (steep) {
    std::swap(a.x, a.y);
    std::swap(b.x, b.y);
  }
  if (a.x > b.x) std::swap(a, b);
  // Draw one pixel per step along the line's major axis.
  const int64_t along = steep ? view_.height : view_.width;
  const int64_t across = steep ? view_.width : view_.height;
  const int64_t first = std::max<int64_t>(0, DivideDown(a.x, kSubpixels));
  const int64_t last = std::min<int64_t>(along - 1, DivideDown(b.x, kSubpixels));
  for (int64_t i = first; i <= last; i++) {
    const int64_t far = std::clamp(i * kSubpixels + kSubpixels / 2, a.x, b.x) - a.x;
    const int64_t rise = b.x > a.x ? DivideDown(far * (b.y - a.y), b.x - a.x) : 0;
    const int64_t k = DivideDown(a.y + rise, kSubpixels);
    if (k < 0 || k >= across) continue;
    Blend(steep ? k : i, steep ? i : k, ink);
  }
}

void Canvas::DrawOutline(const std::vector<point_t>& points, const Ink& ink) {
  for (size_t i = 0; i < points.size(); i++)
    DrawLine(points[i > 0 ? i - 1 : points.size() - 1], points[i], ink);
}

}  // namespace Stg::python
