// SPDX-License-Identifier: GPL-2.0-or-later
//
// Areas and lines, drawn into pixels.
//
// The window draws with OpenGL, which the package does without: it would need a driver and the
// window's libraries, and drivers don't agree on pixels. Here corners are rounded to parts of a
// pixel, and all that follows is arithmetic of integers, so that a picture has the same bits on
// every machine.

#ifndef STAGE_PYTHON_CANVAS_HH
#define STAGE_PYTHON_CANVAS_HH

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/color.hh"
#include "geometry/geometry.hh"

namespace Stg::python {

/// What part of the plane a picture shows.
struct View {
  int width, height;  ///< pixels
  double x, y;        ///< its middle, metres
  double scale;       ///< pixels per metre
};

class Canvas {
 public:
  /// A colour: each part 0 to 255.
  struct Ink {
    uint8_t red, green, blue, opacity;

    static Ink Of(const Color& color);
    Ink Darker() const;
  };

  /// Draws into the pixels: red, green and blue of each, the top row first.
  Canvas(const View& view, uint8_t* pixels);

  void Clear(const Ink& ink);
  /// To be called for each outline of an area. Points are in metres; those that are not finite, or
  /// very far away, are moved to where they don't matter.
  void AddOutline(const std::vector<point_t>& points);
  /// Fills what lies within an odd number of the outlines, and forgets them.
  void Fill(const Ink& ink);
  /// One pixel wide.
  void DrawLine(const point_t& from, const point_t& to, const Ink& ink);
  void DrawOutline(const std::vector<point_t>& points, const Ink& ink);

 private:
  struct Corner {
    int64_t x, y;  // parts of a pixel, from the top left corner of the picture
  };
  struct Crossing {
    int32_t row;
    int32_t column;  // the first pixel behind it
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
