// SPDX-License-Identifier: GPL-2.0-or-later
//
// A mapper transforms the end points of scans to the world frame, by the poses that a robot
// reports. In a room with known walls, the distances of the end points from the walls show how well
// scans and poses fit together.

#ifndef STAGE_TESTS_MAPPER_HH
#define STAGE_TESTS_MAPPER_HH

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "geometry/trigonometry.hh"
#include "stage.hh"

namespace Stg {

/// A world with a square room, whose walls have inner faces at x, y = +-5 m, and with `rest`.
inline std::string Room(const std::string& rest) {
  return "ray_model \"exact\"\n"
         "model( pose [0 5.5 0 0] size [12 1 10] )\nmodel( pose [0 -5.5 0 0] size [12 1 10] )\n"
         "model( pose [5.5 0 0 0] size [1 12 10] )\nmodel( pose [-5.5 0 0 0] size [1 12 10] )\n" +
         rest;
}

class Mapper {
 public:
  /// Adds a range that was measured along `bearing` from `sensor`, a pose in the world frame.
  void Add(const Pose& sensor, double bearing, double range) {
    const SineCosine ray = SinCos(sensor.a + bearing);
    const double x = sensor.x + range * ray.cosine, y = sensor.y + range * ray.sine;
    errors_.push_back(std::fabs(std::max(std::fabs(x), std::fabs(y)) - 5));
  }
  size_t points() const { return errors_.size(); }
  /// A quantile of the distances in metres; 0: the minimum, 1: the maximum. NaN without points.
  double Quantile(double share) {
    if (errors_.empty()) return std::nan("");
    const auto place = errors_.begin() +
                       static_cast<std::ptrdiff_t>(share * static_cast<double>(errors_.size() - 1));
    std::nth_element(errors_.begin(), place, errors_.end());
    return *place;
  }
  void Print(const std::string& what) {
    std::printf("%-60s %7zu points, mm: median %8.3f, 90 %% %8.3f, max %8.3f\n", what.c_str(),
                points(), 1e3 * Quantile(0.5), 1e3 * Quantile(0.9), 1e3 * Quantile(1));
  }

 private:
  std::vector<double> errors_;
};

}  // namespace Stg

#endif
