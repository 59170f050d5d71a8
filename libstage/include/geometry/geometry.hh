// SPDX-License-Identifier: GPL-2.0-or-later
//
// The value types of Stage's interface: poses, velocities, sizes, bounds, points. Lengths are in
// metres and angles in radians, counter-clockwise, unless a name says otherwise.
// Part of <stage.hh>; compiles as C++11.

#ifndef STAGE_GEOMETRY_GEOMETRY_HH
#define STAGE_GEOMETRY_GEOMETRY_HH

#include <stdint.h>

#include <cmath>
#include <string>

#include "geometry/trigonometry.hh"

struct timeval;  // defined in <sys/time.h>

namespace Stg {

class RandomStream;
class Worldfile;

typedef uint32_t id_t;
typedef double meters_t;
typedef double radians_t;
typedef struct timeval time_t;
typedef unsigned long msec_t;
typedef uint64_t usec_t;  // simulated time
typedef double kg_t;
typedef double joules_t;
typedef double watts_t;

const double thousand = 1e3;
const double million = 1e6;
const double billion = 1e9;

inline double rtod(double r) { return r * 180.0 / M_PI; }
inline double dtor(double d) { return d * M_PI / 180.0; }

/// The equivalent angle in [-pi, pi], both ends included. Angles in range are returned bit for bit.
/// An infinite angle gives NaN.
double normalize(double a);

/// Returns -1 for negative arguments, otherwise 1.
inline int sgn(int a) { return a < 0 ? -1 : 1; }
inline double sgn(double a) { return a < 0 ? -1.0 : 1.0; }

/// Clamps val to [minval, maxval]. NaN passes through.
double constrain(double val, double minval, double maxval);

/// Extent of a box along x, y and z.
class Size {
 public:
  meters_t x, y, z;

  Size(meters_t x_, meters_t y_, meters_t z_) : x(x_), y(y_), z(z_) {}
  Size() : x(0.4), y(0.4), z(1.0) {}

  void Zero() { x = y = z = 0.0; }
  Size& Load(Worldfile* wf, int section, const char* keyword);
  void Save(Worldfile* wf, int section, const char* keyword) const;
};

/// A position and a heading about the z axis; also the coordinate frame that they define.
class Pose {
 public:
  meters_t x, y, z;
  radians_t a;

  Pose(meters_t x_, meters_t y_, meters_t z_, radians_t a_) : x(x_), y(y_), z(z_), a(a_) {}
  Pose() : x(0.0), y(0.0), z(0.0), a(0.0) {}
  Pose(const Pose&) = default;
  Pose& operator=(const Pose&) = default;
  virtual ~Pose() {}

  /// A random pose: uniform in the rectangle and over all headings, with z = 0. Uses
  /// RandomStream::Current() or the given stream.
  static Pose Random(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax);
  static Pose Random(RandomStream& random, meters_t xmin, meters_t xmax, meters_t ymin,
                     meters_t ymax);

  virtual void Print(const char* prefix) const;
  /// Returns "[ x y z a ]" with three decimals each.
  std::string String() const;

  bool IsZero() const { return x == 0 && y == 0 && z == 0 && a == 0; }
  void Zero() { x = y = z = a = 0.0; }

  /// Transforms p from this frame to the parent frame of this pose.
  Pose operator+(const Pose& p) const;
  /// True if this pose is nearer to the origin of the plane.
  bool operator<(const Pose& p) const { return x * x + y * y < p.x * p.x + p.y * p.y; }
  bool operator==(const Pose& o) const { return x == o.x && y == o.y && z == o.z && a == o.a; }
  bool operator!=(const Pose& o) const { return !(*this == o); }
  /// Distance in the plane.
  meters_t Distance(const Pose& other) const { return Hypotenuse(x - other.x, y - other.y); }

  Pose& Load(Worldfile* wf, int section, const char* keyword);
  void Save(Worldfile* wf, int section, const char* keyword);
};

/// Speeds forwards, to the left and upwards in m/s; rate of turn in radians per second.
class Velocity : public Pose {
 public:
  Velocity(double vx, double vy, double vz, double va) : Pose(vx, vy, vz, va) {}
  Velocity() {}

  Velocity& Load(Worldfile* wf, int section, const char* keyword);
  void Print(const char* prefix) const override;
};

/// Pose of a model's body in the model's frame, and its size.
class Geom {
 public:
  Pose pose;
  Size size;

  Geom() {}
  Geom(const Pose& p, const Size& s) : pose(p), size(s) {}

  void Zero() {
    pose.Zero();
    size.Zero();
  }
  void Print(const char* prefix) const;
};

/// A closed interval.
class Bounds {
 public:
  double min, max;

  Bounds() : min(0), max(0) {}
  Bounds(double lo, double hi) : min(lo), max(hi) {}

  double Constrain(double value) { return constrain(value, min, max); }
  Bounds& Load(Worldfile* wf, int section, const char* keyword);
};

/// An axis-parallel box.
class bounds3d_t {
 public:
  Bounds x, y, z;

  bounds3d_t() {}
  bounds3d_t(const Bounds& bx, const Bounds& by, const Bounds& bz) : x(bx), y(by), z(bz) {}
};

class point_t {
 public:
  meters_t x, y;

  point_t(meters_t px, meters_t py) : x(px), y(py) {}
  point_t() : x(0.0), y(0.0) {}

  point_t& operator+=(const point_t& o) {
    x += o.x;
    y += o.y;
    return *this;
  }
  bool operator<(const point_t& o) const { return x < o.x || (x == o.x && y < o.y); }
  bool operator==(const point_t& o) const { return x == o.x && y == o.y; }
};

class point3_t {
 public:
  meters_t x, y, z;

  point3_t(meters_t px, meters_t py, meters_t pz) : x(px), y(py), z(pz) {}
  point3_t() : x(0.0), y(0.0), z(0.0) {}
};

/// A cell of the grid.
class point_int_t {
 public:
  int x, y;

  point_int_t(int px, int py) : x(px), y(py) {}
  point_int_t() : x(0), y(0) {}

  bool operator<(const point_int_t& o) const { return x < o.x || (x == o.x && y < o.y); }
  bool operator==(const point_int_t& o) const { return x == o.x && y == o.y; }
};

/// A rectangle at any pose in the plane.
typedef struct {
  Pose pose;
  Size size;
} rotrect_t;

typedef struct {
  Bounds range;
  radians_t angle;
} fov_t;

/// Returns a new array of (0, 0), (1, 0), (1, 1) and (0, 1). The caller must delete[] it.
point_t* unit_square_points_create();

}  // namespace Stg

#endif
