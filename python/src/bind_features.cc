// SPDX-License-Identifier: GPL-2.0-or-later
//
// Parts of observations of learning environments: see stagesim/env/features.py. They have the same
// bits on all processors, unlike sines and cosines of NumPy.

#include <nanobind/ndarray.h>

#include <cmath>

#include "bindings.hh"
#include "checked_argument.hh"
#include "geometry/trigonometry.hh"

namespace Stg::python {

namespace {

using Doubles = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Poses = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, -1, 2>, nb::device::cpu>;
using Floats = nb::ndarray<float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Distances = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

struct Away {
  double x, y;
  double distance() const { return std::sqrt(x * x + y * y); }
};

/// Calls f(index of the robot, its pose, the way to its point) for each robot of each world.
template <typename F>
void ForEachRobot(const Poses& poses, const Points& points, F f) {
  const size_t worlds = poses.shape(0), robots = poses.shape(1);
  if (points.shape(0) != worlds || points.shape(1) != robots)
    throw nb::value_error("found another number of points than of poses");
  const double* pose = poses.data();
  for (size_t i = 0; i < worlds; i++)
    for (size_t j = 0; j < robots; j++, pose += 3) {
      const double* const point = points.data() + static_cast<int64_t>(i) * points.stride(0) +
                                  static_cast<int64_t>(j) * points.stride(1);
      f(i * robots + j, pose, Away{point[0] - pose[0], point[points.stride(2)] - pose[1]});
    }
}

void FindTowards(const Poses& poses, const Points& points, double far, const Floats& to) {
  if (to.size() != poses.size()) throw nb::value_error("found an array of another shape");
  float* const made = to.data();
  ForEachRobot(poses, points, [=](size_t i, const double* pose, const Away& away) {
    const double distance = away.distance();
    const auto [sine, cosine] = SinCos(pose[2]);
    const double inverse = 1 / distance;
    const bool is_here = distance == 0;
    made[3 * i] = static_cast<float>(distance < far    ? distance / far
                                     : distance >= far ? 1
                                                       : distance);
    made[3 * i + 1] = is_here ? 1 : static_cast<float>((away.x * cosine + away.y * sine) * inverse);
    made[3 * i + 2] = is_here ? 0 : static_cast<float>((away.y * cosine - away.x * sine) * inverse);
  });
}

void FindDistances(const Poses& poses, const Points& points, const Distances& to) {
  if (3 * to.size() != poses.size()) throw nb::value_error("found an array of another shape");
  double* const made = to.data();
  ForEachRobot(poses, points,
               [=](size_t i, const double*, const Away& away) { made[i] = away.distance(); });
}

void FindFreeSpace(
    const nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>& ranges,
    double reach, const Floats& to) {
  if (to.size() != ranges.size()) throw nb::value_error("found an array of another shape");
  const double* const from = ranges.data();
  float* const made = to.data();
  const double scale = 1 / reach;
  const size_t count = ranges.size();
  for (size_t i = 0; i < count; i++) {
    const double share = from[i] * scale;
    made[i] = static_cast<float>(share < 1 ? share : 1);  // 1 for NaN
  }
}

void FindSpeeds(const Poses& velocities, double forwards, double turning, const Floats& to) {
  if (3 * to.size() != 2 * velocities.size())
    throw nb::value_error("found an array of another shape");
  const double* const from = velocities.data();
  float* const made = to.data();
  for (size_t i = 0; i < velocities.size() / 3; i++) {
    made[2 * i] = static_cast<float>(from[3 * i] * forwards);
    made[2 * i + 1] = static_cast<float>(from[3 * i + 2] * turning);
  }
}

}  // namespace

void BindFeatures(nb::module_& module) {
  module.def("find_towards", &FindTowards, nb::arg("poses"), nb::arg("points"), nb::arg("far"),
             nb::arg("to"), "Writes distances from 0 to 1, cosines and sines of bearings.");
  module.def("find_distances", &FindDistances, nb::arg("poses"), nb::arg("points"), nb::arg("to"),
             "Writes distances in metres.");
  module.def("find_free_space", &FindFreeSpace, nb::arg("ranges"), nb::arg("reach"), nb::arg("to"),
             "Writes ranges in units of `reach`, from 0 to 1; without a reading 1.");
  module.def("find_speeds", &FindSpeeds, nb::arg("velocities"), nb::arg("forwards"),
             nb::arg("turning"), nb::arg("to"), "Writes speeds times these factors.");
}

}  // namespace Stg::python
