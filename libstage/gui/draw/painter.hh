// SPDX-License-Identifier: GPL-2.0-or-later
//
// Adds lines, areas and text to a painting, in a coordinate frame that the caller chooses.

#ifndef STAGE_GUI_DRAW_PAINTER_HH
#define STAGE_GUI_DRAW_PAINTER_HH

#include <string_view>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"
#include "gui/draw/primitives.hh"

namespace Stg::draw {

class Painter {
 public:
  explicit Painter(Painting* painting) : painting_(*painting) { SetFrame(Pose()); }

  /// Sets the frame of all later coordinates. `frame` is given in world coordinates.
  void SetFrame(const Pose& frame);
  const Pose& frame() const { return frame_; }
  void SetColor(const Rgba& color) { color_ = color; }

  void Point(double x, double y, double z = 0);
  void Line(const point3_t& from, const point3_t& to, bool thick = false);
  /// Draws dashes and gaps of `dash` metres each, or longer ones to limit their number.
  void DashedLine(const point3_t& from, const point3_t& to, double dash);
  void Triangle(const point3_t& a, const point3_t& b, const point3_t& c);
  void Quad(const point3_t& a, const point3_t& b, const point3_t& c, const point3_t& d);

  // Horizontal at height z, with sides along the axes of the frame.
  void Rectangle(const Bounds& x, const Bounds& y, double z);
  void RectangleOutline(const Bounds& x, const Bounds& y, double z, bool thick = false);
  /// A circular sector that starts at heading `from` and extends counter-clockwise by `angle`.
  void Sector(double radius, double from, double angle, double z);
  void SectorOutline(double radius, double from, double angle, double z, bool to_centre = true);

  void Text(const point3_t& at, std::string_view text, Align align = Align::kLeft,
            LabelKind kind = LabelKind::kPlain);

 private:
  Vertex At(double x, double y, double z) const;
  Vertex At(const point3_t& p) const { return At(p.x, p.y, p.z); }

  Painting& painting_;
  Pose frame_;
  SineCosine turn_{0, 1};
  Rgba color_ = kBlack;
};

inline point3_t Between(const point3_t& a, const point3_t& b, double fraction) {
  return point3_t(a.x + fraction * (b.x - a.x), a.y + fraction * (b.y - a.y),
                  a.z + fraction * (b.z - a.z));
}

}  // namespace Stg::draw

#endif
