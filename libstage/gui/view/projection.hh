// SPDX-License-Identifier: GPL-2.0-or-later
//
// From metres to pixels and back, for both cameras. No OpenGL, but its conventions: matrices by
// columns, clip coordinates within -w..w.

#ifndef STAGE_GUI_VIEW_PROJECTION_HH
#define STAGE_GUI_VIEW_PROJECTION_HH

#include <array>
#include <optional>

#include "geometry/geometry.hh"
#include "gui/view/view_state.hh"

namespace Stg::view {

using Matrix = std::array<double, 16>;  ///< element (row, column) is [column * 4 + row]

Matrix Multiply(const Matrix& a, const Matrix& b);

class Projection {
 public:
  /// A canvas of width x height pixels. `reach`: a box that holds all that is to be seen; only the
  /// depths of the flat view depend on it.
  Projection(const ViewState& view, int width, int height, const bounds3d_t& reach);

  int width() const { return width_; }
  int height() const { return height_; }
  const Matrix& projection() const { return projection_; }  ///< eye to clip coordinates
  const Matrix& modelview() const { return modelview_; }    ///< world to eye coordinates
  const Matrix& both() const { return both_; }

  /// Pixels from the left and the bottom of the canvas; z is the depth, 0..1 where it is seen.
  /// Nothing for points behind a perspective camera.
  std::optional<point3_t> ToPixels(const point3_t& point) const;

  /// The line of sight through a pixel (from the left and the TOP of the canvas, as toolkits
  /// count): from `from`, on the near plane, to `to`, on the far one.
  struct Sight {
    point3_t from, to;
  };
  Sight SightAt(double x, double y_from_top) const;
  /// Where that line meets the horizontal plane at height z; nothing if it does not.
  std::optional<point_t> FloorPoint(double x, double y_from_top, double z = 0) const;

  /// Whether some of a ball may be in the picture.
  bool Sees(double x, double y, double z, double radius) const {
    for (const Plane& p : planes_)
      if (p.x * x + p.y * y + p.z * z + p.d < -radius) return false;
    return true;
  }
  /// The length of a pixel at a point, metres.
  double PixelAt(const point3_t& point) const;

 private:
  struct Plane {
    double x, y, z, d;  // inside: the sum is positive, metres
  };
  void MakePlanes();

  int width_, height_;
  Matrix projection_, modelview_, both_, inverse_;
  std::array<Plane, 6> planes_;
};

}  // namespace Stg::view

#endif
