// SPDX-License-Identifier: GPL-2.0-or-later
//
// Renders prisms in colour and depth as a pinhole camera sees them.
//
// View coordinates: `right` and `ahead` are horizontal, `ahead` along the camera's heading; heights
// are relative to the eye. For a camera tilted down by t,
//   depth = ahead cos t - height sin t,  up = ahead sin t + height cos t.
// The depth buffer holds reciprocal depths, which on a plane are linear in picture coordinates.
// Each face is filled with its plane's equation, so coplanar faces agree in every pixel. Among
// equally deep faces the one drawn first wins, on every machine.

#ifndef STAGE_MODELS_TYPES_CAMERA_RASTER_HH
#define STAGE_MODELS_TYPES_CAMERA_RASTER_HH

#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {
class StateExchange;
}

namespace Stg::camera {

struct Lens {
  Pose eye;                        ///< its heading is that of the view
  double tilt = 0;                 ///< radians, positive downwards
  double half_width, half_height;  ///< tangents of half the fields of view
  double near, far;                ///< depths, 0 < near < far
};

struct Rgba {
  uint8_t r, g, b, a;

  void ExchangeState(StateExchange& exchange);
};

class Raster {
 public:
  /// Clears the picture. Both arrays have width * height elements, bottom row first.
  void Begin(const Lens& lens, int width, int height, float* depth, Rgba* color);

  /// False if nothing within the vertical cylinder can be visible.
  bool MayShow(double x, double y, double radius) const;
  /// False if the cylinder is beyond the near plane, so that no body within is cut open by it.
  bool MayBeCut(double x, double y, double radius) const;

  /// Draws the walls of a prism. The outline is in `frame` (its z is ignored), heights are global.
  void DrawWalls(const std::vector<point_t>& outline, const Pose& frame, const Bounds& z,
                 Rgba color);
  /// Horizontal faces: FillOutlines() fills the outlines added since its last call at one height.
  /// An outline of opposite orientation inside another is a hole. Do not fill at the height of the
  /// eye, where faces are invisible.
  void AddOutline(const std::vector<point_t>& outline, const Pose& frame, double z);
  void FillOutlines(double z, Rgba color);
  bool IsAboveEye(double z) const { return z > lens_.eye.z; }
  bool IsBelowEye(double z) const { return z < lens_.eye.z; }

  /// Converts `depth` to metres; the far distance where nothing was drawn.
  void Finish();

 private:
  /// A corner in plan, and the bounds of the view that it exceeds.
  struct Corner {
    double right, ahead;
    unsigned beyond;
  };
  struct Point {
    double right, up, depth;
  };
  struct Crossing {  // of an edge with the centre line of a pixel row
    double x;
    int direction;
    int next;  // index of the next in the row, or -1
  };
  /// Reciprocal depth as a linear function of picture coordinates x and y in pixels.
  struct Plane {
    double constant, x, y;
  };

  void PlaceCorners(const std::vector<point_t>& outline, const Pose& frame);
  unsigned Beyond(double right, double ahead) const;
  Point At(const Corner& corner, double height) const;
  Plane MakePlane(double right, double up, double depth, double product) const;
  /// Adds the edges of polygon_ after clipping it to the near plane.
  void AddPolygon();
  void ClipToNear();
  void AddEdge(const Point& from, const Point& to);
  void Fill(const Plane& plane, Rgba color);
  void FillRow(int row, const Plane& plane, Rgba color);
  void FillSpan(int row, double from, double to, const Plane& plane, Rgba color);

  Lens lens_;
  int width_ = 0, height_ = 0;
  float* depth_ = nullptr;
  Rgba* color_ = nullptr;
  float nothing_ = 0;                       // reciprocal of the far distance
  double view_cosine_ = 1, view_sine_ = 0;  // of the view's heading
  double tilt_cosine_ = 1, tilt_sine_ = 0;
  double wedge_ = -1;       // bound of |right| / ahead in plan; negative: unbounded
  double wedge_scale_ = 1;  // converts the slope into a distance
  double reach_ = 0;        // horizontal distance of the farthest visible point
  double near_reach_ = 0;   // the same for the near plane
  double ahead_limit_ = 0;  // largest `ahead` of a visible point

  std::vector<Corner> corners_;
  std::vector<Point> polygon_, clipped_;
  std::vector<Crossing> crossings_;
  std::vector<int> first_of_row_;  // index in crossings_, or -1
  int first_row_ = 0, end_row_ = 0;
  std::vector<Crossing> row_;
};

}  // namespace Stg::camera

#endif
