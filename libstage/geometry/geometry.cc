// SPDX-License-Identifier: GPL-2.0-or-later

#include "geometry/geometry.hh"

#include <cstdio>

#include "random/random.hh"

namespace Stg {

point_t* unit_square_points_create() {
  return new point_t[4]{point_t(0, 0), point_t(1, 0), point_t(1, 1), point_t(0, 1)};
}

double normalize(double a) {
  if (a >= -M_PI && a <= M_PI) return a;
  // If the angle is out of range by less than a turn, a single addition gives the same result as
  // Stage 4.3. For larger angles, repeated additions might never end.
  if (std::fabs(a) < 3.0 * M_PI) return a > M_PI ? a - 2.0 * M_PI : a + 2.0 * M_PI;
  return std::remainder(a, 2.0 * M_PI);
}

double constrain(double val, double minval, double maxval) {
  if (val < minval) return minval;
  if (val > maxval) return maxval;
  return val;
}

Pose Pose::Random(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax) {
  return Random(RandomStream::Current(), xmin, xmax, ymin, ymax);
}

Pose Pose::Random(RandomStream& random, meters_t xmin, meters_t xmax, meters_t ymin,
                  meters_t ymax) {
  const double x = random.Uniform(xmin, xmax);
  const double y = random.Uniform(ymin, ymax);
  return Pose(x, y, 0, normalize(random.Uniform(0, 2.0 * M_PI)));
}

Pose Pose::operator+(const Pose& p) const {
  const SineCosine turn = SinCos(a);
  return Pose(x + p.x * turn.cosine - p.y * turn.sine, y + p.x * turn.sine + p.y * turn.cosine,
              z + p.z, normalize(a + p.a));
}

void Pose::Print(const char* prefix) const {
  printf("%s pose [x:%.3f y:%.3f z:%.3f a:%.3f]\n", prefix, x, y, z, a);
}

std::string Pose::String() const {
  char text[256];
  snprintf(text, sizeof text, "[ %.3f %.3f %.3f %.3f ]", x, y, z, a);
  return text;
}

void Velocity::Print(const char* prefix) const {
  if (prefix) printf("%s", prefix);
  printf("velocity [x:%.3f y:%.3f z:%.3f a:%.3f]\n", x, y, z, a);
}

void Geom::Print(const char* prefix) const {
  if (prefix) printf("%s", prefix);
  printf("geom pose: (%.2f,%.2f,%.2f) size: [%.2f,%.2f]\n", pose.x, pose.y, pose.a, size.x, size.y);
}

}  // namespace Stg
