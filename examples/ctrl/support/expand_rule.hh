// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drives towards open space with a ring of single-ray sensors: each reading attracts the robot in
// its direction, in proportion to its range.

#ifndef EXAMPLES_CTRL_SUPPORT_EXPAND_RULE_HH
#define EXAMPLES_CTRL_SUPPORT_EXPAND_RULE_HH

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "geometry/trigonometry.hh"
#include "set_up.hh"

namespace ctrl {

using Sensors = std::vector<Stg::ModelRanger::Sensor>;
/// All sensors, or the first ones.
using SensorSpan = std::span<const Stg::ModelRanger::Sensor>;

/// Returns the reading of a single-ray sensor; 0 if it has none.
inline double Reading(const Stg::ModelRanger::Sensor& sensor) {
  return sensor.ranges.empty() ? 0.0 : sensor.ranges[0];
}

/// Returns the vector sum of all readings in their sensors' directions.
inline Stg::point_t OpenSpace(SensorSpan sensors) {
  Stg::point_t sum;
  for (const auto& sensor : sensors) {
    const Stg::SineCosine direction = Stg::SinCos(sensor.pose.a);
    sum.x += Reading(sensor) * direction.cosine;
    sum.y += Reading(sensor) * direction.sine;
  }
  return sum;
}

/// The robot moves only if this sensor reads more than the distance.
struct Clearance {
  size_t sensor;
  double distance;  ///< m
};

struct ExpandRule {
  double speed;                           ///< m/s
  std::span<const Clearance> clearances;  ///< all must hold
  double turn_gain = 1.0;                 ///< rad/s per rad
  double ahead = 0.5;                     ///< rad; move only if the goal is this far ahead
};

/// Returns the command of one update; nothing if the sum lies exactly on an axis, so that the last
/// command stands. `sensors` must contain all sensors of the rule.
inline std::optional<Drive> Expand(SensorSpan sensors, const ExpandRule& rule) {
  const Stg::point_t open = OpenSpace(sensors);
  if (open.x == 0.0 || open.y == 0.0) return std::nullopt;
  const double theta = Stg::ArcTangent(open.y, open.x);
  bool clear = std::fabs(theta) < rule.ahead;
  for (const Clearance& c : rule.clearances)
    clear = clear && Reading(sensors[c.sensor]) > c.distance;
  return Drive{clear ? rule.speed : 0.0, rule.turn_gain * theta};
}

}  // namespace ctrl

#endif
