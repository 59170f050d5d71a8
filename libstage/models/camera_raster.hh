// SPDX-License-Identifier: GPL-2.0-or-later
//
// A picture of prisms, in colour and in depth, as a pinhole camera sees them.
//
// Coordinates of the view: `right` and `ahead` are horizontal, `ahead` being the heading that the
// camera looks along; heights count from the eye. With a camera that is tilted down by t,
//   depth = ahead cos t - height sin t,  up = ahead sin t + height cos t.
// The picture is kept as reciprocal depths, for these are linear in the coordinates of the picture
// on every plane. So each face is filled with the plane's own equation: faces in one plane agree
// in every pixel, and of equally deep faces the one drawn first stays, whatever the machine.

#ifndef STAGE_MODELS_CAMERA_RASTER_HH
#define STAGE_MODELS_CAMERA_RASTER_HH

#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {
class StateExchange;
}

namespace Stg::camera {

struct Lens {
  Pose eye;                        ///< its heading is the one looked along
  double tilt = 0;                 ///< radians, downwards
  double half_width, half_height;  ///< of the picture, at a depth of 1: tangents of half the fields
  double near, far;                ///< depths, 0 < near < far
};

struct Rgba {
  uint8_t r, g, b, a;

  void ExchangeState(StateExchange& exchange);
};

class Raster {
 public:
  /// Clears the picture. Both arrays have width * height elements, the bottom row first.
  void Begin(const Lens& lens, int width, int height, float* depth, Rgba* color);

  /// False if nothing within a vertical cylinder can be in the picture.
  bool MayShow(double x, double y, double radius) const;
  /// False if nothing within it is as near as the near plane: then nobody looks into a body there.
  bool MayBeCut(double x, double y, double radius) const;

  /// The walls of a prism; the outline is in the frame (its z plays no part), heights are global.
  void DrawWalls(const std::vector<point_t>& outline, const Pose& frame, const Bounds& z,
                 Rgba color);
  /// Horizontal faces: the outlines added since the last call are filled together at one height.
  /// Where an outline runs the other way around inside of another, it is a hole. At the height of
  /// the eye there is nothing to be seen of them; don't fill them there.
  void AddOutline(const std::vector<point_t>& outline, const Pose& frame, double z);
  void FillOutlines(double z, Rgba color);
  bool IsAboveEye(double z) const { return z > lens_.eye.z; }
  bool IsBelowEye(double z) const { return z < lens_.eye.z; }

  /// Turns what is in `depth` into metres; where there is nothing, the far distance.
  void Finish();

 private:
  /// A corner seen from above, and the sides of the view that it is beyond.
  struct Corner {
    double right, ahead;
    unsigned beyond;
  };
  struct Point {
    double right, up, depth;
  };
  struct Crossing {  // of an edge with the middle of a row of pixels
    double x;
    int direction;
    int next;  // in the same row, or -1
  };
  /// Reciprocal depth at the picture's coordinates x and y, in pixels.
  struct Plane {
    double constant, x, y;
  };

  void PlaceCorners(const std::vector<point_t>& outline, const Pose& frame);
  unsigned Beyond(double right, double ahead) const;
  Point At(const Corner& corner, double height) const;
  Plane MakePlane(double right, double up, double depth, double product) const;
  /// Adds the edges of polygon_, as far as they are in front of the near plane.
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
  float nothing_ = 0;                       // the reciprocal of the far distance
  double view_cosine_ = 1, view_sine_ = 0;  // of the heading
  double tilt_cosine_ = 1, tilt_sine_ = 0;
  double wedge_ = -1;       // seen from above, the view's |right| / ahead; negative: all around
  double wedge_scale_ = 1;  // its slope as a distance
  double reach_ = 0;        // horizontal distance of the farthest visible point
  double near_reach_ = 0;   // of the farthest point of the near plane
  double ahead_limit_ = 0;  // the same, ahead only

  std::vector<Corner> corners_;
  std::vector<Point> polygon_, clipped_;
  std::vector<Crossing> crossings_;
  std::vector<int> first_of_row_;  // crossings, or -1
  int first_row_ = 0, end_row_ = 0;
  std::vector<Crossing> row_;
};

}  // namespace Stg::camera

#endif
