// SPDX-License-Identifier: GPL-2.0-or-later
//
// Parts of observations of learning environments: see stagesim/env/features.py. They have the same
// bits on all processors, unlike sines and cosines of NumPy.

#include <nanobind/ndarray.h>

#include <cmath>
#include <cstdint>
#include <utility>

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

using Keys = nb::ndarray<const uint64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Bits = nb::ndarray<uint64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// SplitMix64: see stagesim/env/randoms.py.
void FindBits(const Keys& keys, uint64_t first, const Bits& to) {
  if (to.shape(0) != keys.shape(0)) throw nb::value_error("found an array of another shape");
  uint64_t* made = to.data();
  for (size_t i = 0; i < keys.size(); i++)
    for (uint64_t j = 0; j < to.shape(1); j++) {
      uint64_t bits = keys.data()[i] + (first + j) * 0x9E3779B97F4A7C15U;
      bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9U;
      bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBU;
      *made++ = bits ^ (bits >> 31);
    }
}

template <typename T>
using OfRobots = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <typename T>
using OfWorlds = nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T>
using Given = nb::ndarray<const T, nb::ndim<2>, nb::device::cpu>;

/// An element of an array that may be a view.
template <typename T>
T At(const Given<T>& array, size_t i, size_t j) {
  return array.data()[static_cast<int64_t>(i) * array.stride(0) +
                      static_cast<int64_t>(j) * array.stride(1)];
}

/// See Episodes._settle() in stagesim/env/episodes.py.
void Settle(const Given<double>& reward, const Given<bool>& terminates, const Poses& poses,
            const OfWorlds<const bool>& going, const OfWorlds<const bool>& at_limit,
            const OfRobots<bool>& live, const OfRobots<double>& rewards,
            const OfRobots<bool>& terminated, const OfRobots<bool>& truncated,
            const nb::ndarray<bool, nb::shape<3, -1>, nb::c_contig, nb::device::cpu>& of_worlds) {
  const size_t worlds = live.shape(0), robots = live.shape(1);
  for (const auto& [found, wanted] : {std::pair(reward.size(), live.size()),
                                      {terminates.size(), live.size()},
                                      {poses.size(), 3 * live.size()},
                                      {going.size(), worlds},
                                      {at_limit.size(), worlds},
                                      {rewards.size(), live.size()},
                                      {terminated.size(), live.size()},
                                      {truncated.size(), live.size()},
                                      {of_worlds.size(), 3 * worlds}})
    if (found != wanted) throw nb::value_error("found an array of another shape");
  for (size_t i = 0; i < worlds; i++) {
    bool any_ended = false, any_truncated = false, any_live = false;
    for (size_t j = 0; j < robots; j++) {
      const size_t k = i * robots + j;
      const bool takes_part = live.data()[k] && going.data()[i];
      const double gained = At(reward, i, j);
      const bool ends = takes_part && (At(terminates, i, j) || std::isnan(poses.data()[3 * k]));
      const bool is_cut = takes_part && !ends && at_limit.data()[i];
      rewards.data()[k] = takes_part && !std::isnan(gained) ? gained : 0;
      terminated.data()[k] = ends;
      truncated.data()[k] = is_cut;
      live.data()[k] = live.data()[k] && !ends && !is_cut;
      any_ended = any_ended || ends || is_cut;
      any_truncated = any_truncated || is_cut;
      any_live = any_live || live.data()[k];
    }
    const bool is_over = any_ended && !any_live;
    of_worlds.data()[i] = is_over;
    of_worlds.data()[worlds + i] = is_over && !any_truncated;
    of_worlds.data()[2 * worlds + i] = any_truncated;
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
  module.def("find_bits", &FindBits, nb::arg("keys"), nb::arg("first"), nb::arg("to"),
             "Writes random bits of streams with these keys, from number `first` on.");
  module.def("settle", &Settle, nb::arg("reward"), nb::arg("terminates"), nb::arg("poses"),
             nb::arg("going"), nb::arg("at_limit"), nb::arg("live"), nb::arg("rewards"),
             nb::arg("terminated"), nb::arg("truncated"), nb::arg("of_worlds"),
             "Ends the episodes of robots and worlds after an action.");
}

}  // namespace Stg::python
