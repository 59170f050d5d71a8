// SPDX-License-Identifier: GPL-2.0-or-later
//
// Maps metres to pixels and back for both cameras. Follows OpenGL's conventions without using it:
// column-major matrices, clip coordinates within -w..w.

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
  /// For a canvas of width x height pixels. `reach` is a bounding box of everything to show; it
  /// only affects the depth range of the flat view.
  Projection(const ViewState& view, int width, int height, const bounds3d_t& reach);

  int width() const { return width_; }
  int height() const { return height_; }
  const Matrix& projection() const { return projection_; }  ///< eye to clip coordinates
  const Matrix& modelview() const { return modelview_; }    ///< world to eye coordinates
  const Matrix& world_to_clip() const { return world_to_clip_; }

  /// Returns pixels from the lower left corner of the canvas; z is the depth, 0..1 within the view.
  /// Returns nothing for points behind a perspective camera.
  std::optional<point3_t> ToPixels(const point3_t& point) const;

  /// The line of sight through a pixel, from the near plane to the far plane. Pixels count from the
  /// left and the TOP of the canvas, as in toolkits.
  struct LineOfSight {
    point3_t from, to;
  };
  LineOfSight LineOfSightAt(double x, double y_from_top) const;
  /// Returns where the line of sight meets the horizontal plane at height z, if it does.
  std::optional<point_t> FloorPoint(double x, double y_from_top, double z = 0) const;

  /// True if part of a sphere may be in view.
  bool Sees(double x, double y, double z, double radius) const {
    for (const Plane& p : planes_)
      if (p.x * x + p.y * y + p.z * z + p.d < -radius) return false;
    return true;
  }
  /// Side of a pixel at a point, metres.
  double PixelAt(const point3_t& point) const;

 private:
  struct Plane {
    double x, y, z, d;  // signed distance in metres; positive inside
  };
  void MakePlanes();

  int width_, height_;
  Matrix projection_, modelview_, world_to_clip_, inverse_;
  std::array<Plane, 6> planes_;
};

}  // namespace Stg::view

#endif
