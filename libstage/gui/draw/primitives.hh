// SPDX-License-Identifier: GPL-2.0-or-later
//
// Graphics primitives in the memory layout that goes to the graphics card. No OpenGL here.

#ifndef STAGE_GUI_DRAW_PRIMITIVES_HH
#define STAGE_GUI_DRAW_PRIMITIVES_HH

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pictures/color.hh"
#include "pictures/color_byte.hh"

namespace Stg::draw {

struct Rgba {
  uint8_t r = 0, g = 0, b = 0, a = 255;

  bool operator==(const Rgba&) const = default;
  Rgba WithOpacity(double opacity) const { return {r, g, b, ColorByte(opacity)}; }
};
inline Rgba ToRgba(const Color& c) {
  return {ColorByte(c.r), ColorByte(c.g), ColorByte(c.b), ColorByte(c.a)};
}
inline constexpr Rgba kBlack = {0, 0, 0, 255}, kWhite = {255, 255, 255, 255};

/// A vertex of 16 bytes.
struct Vertex {
  float x, y, z;
  Rgba color;
};
static_assert(sizeof(Vertex) == 16);

/// Placement of a body: its shape is rotated by a and moved to (x, y, z). 20 bytes.
struct Instance {
  float x, y, z, a;
  Rgba color;
};
static_assert(sizeof(Instance) == 20);

/// The area that one sensor's rays have swept. The ray ends are in a separate array. 24 bytes.
struct FanInstance {
  float x, y, z, a;
  uint32_t first;  ///< index of its first ray end
  Rgba color;
};
static_assert(sizeof(FanInstance) == 24);

enum class Align { kLeft, kCentre, kRight };
enum class LabelKind { kPlain, kBubble };

/// Text at a point of the world. Its characters are in Painting::letters.
struct Label {
  float x, y, z;
  Rgba color;
  uint32_t first, length;
  Align align;
  LabelKind kind;
};

/// Primitives of one layer of a frame. Clear() keeps the memory for the next frame.
struct Painting {
  std::vector<Vertex> triangles, lines, thick_lines, points;  ///< 3, 2, 2, 1 vertices each
  std::vector<Label> labels;
  std::string letters;

  void Clear() {
    for (auto* list : {&triangles, &lines, &thick_lines, &points}) list->clear();
    labels.clear();
    letters.clear();
  }
  bool empty() const {
    return triangles.empty() && lines.empty() && thick_lines.empty() && points.empty() &&
           labels.empty();
  }
  std::string_view TextOf(const Label& label) const {
    return std::string_view(letters).substr(label.first, label.length);
  }
};

}  // namespace Stg::draw

#endif
