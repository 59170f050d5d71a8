// SPDX-License-Identifier: GPL-2.0-or-later
//
// A software rasterizer for polygons and lines.
//
// The package does not use OpenGL as the window does: OpenGL would need a driver and the window's
// libraries, and drivers differ in their pixels. Here corners are rounded to subpixels, and
// everything after that is integer arithmetic, so that a picture has the same bits on every
// machine.

#ifndef STAGE_PYTHON_CANVAS_HH
#define STAGE_PYTHON_CANVAS_HH

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/geometry.hh"
#include "pictures/color.hh"

namespace Stg::python {

/// The rectangle of the plane that a picture shows.
struct View {
  int width, height;  ///< pixels
  double x, y;        ///< center of the picture, metres
  double scale;       ///< pixels per metre
};

class Canvas {
 public:
  /// An RGBA colour; each component is 0 to 255.
  struct Ink {
    uint8_t red, green, blue, opacity;

    static Ink Of(const Color& color);
    Ink Darker() const;
  };

  /// `pixels` is the image to draw into, not owned: RGB, 3 bytes per pixel, the top row first.
  Canvas(const View& view, uint8_t* pixels);

  void Clear(const Ink& ink);
  /// Adds an outline to the polygon that the next Fill() fills. Points are in metres. A NaN becomes
  /// 0 and a far coordinate is clamped to 2^22 pixels, so that integer products cannot overflow.
  void AddOutline(const std::vector<point_t>& points);
  /// Fills the polygon of all outlines by the even-odd rule, then clears the outlines.
  void Fill(const Ink& ink);
  /// Draws a line of one pixel's width.
  void DrawLine(const point_t& from, const point_t& to, const Ink& ink);
  void DrawOutline(const std::vector<point_t>& points, const Ink& ink);

 private:
  struct Corner {
    int64_t x, y;  // subpixels, from the top left corner of the picture
  };
  struct Crossing {
    int32_t row;
    int32_t column;  // the first pixel to the right of the crossing
    bool operator<(const Crossing& o) const {
      return row != o.row ? row < o.row : column < o.column;
    }
  };
  Corner Place(const point_t& point) const;
  void AddEdge(Corner from, Corner to);
  void Blend(int64_t column, int64_t row, const Ink& ink);

  const View view_;
  uint8_t* const pixels_;
  std::vector<Crossing> crossings_;
};

}  // namespace Stg::python

#endif
