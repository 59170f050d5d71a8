// SPDX-License-Identifier: GPL-2.0-or-later
//
// Driving towards open space with a ring of sensors of one ray each: every reading pulls the robot
// in its direction, the more the farther it reaches.

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
/// All of them, or the first ones.
using SensorSpan = std::span<const Stg::ModelRanger::Sensor>;

/// The reading of a sensor with one ray; 0 if it has none.
inline double Reading(const Stg::ModelRanger::Sensor& sensor) {
  return sensor.ranges.empty() ? 0.0 : sensor.ranges[0];
}

/// The vector sum of all readings, each in the direction that its sensor looks in.
inline Stg::point_t OpenSpace(SensorSpan sensors) {
  Stg::point_t sum;
  for (const auto& sensor : sensors) {
    const Stg::SineCosine direction = Stg::SinCos(sensor.pose.a);
    sum.x += Reading(sensor) * direction.cosine;
    sum.y += Reading(sensor) * direction.sine;
  }
  return sum;
}

/// The robot drives on only if this sensor reads more than this distance.
struct Clearance {
  size_t sensor;
  double distance;  ///< m
};

struct ExpandRule {
  double speed;                           ///< m/s
  std::span<const Clearance> clearances;  ///< all have to hold
  double turn_gain = 1.0;                 ///< rad/s per rad
  double ahead = 0.5;                     ///< rad: drive on only if the goal is this far ahead
};

/// One update; nothing if the sum lies exactly on an axis, in which case the last command stands.
/// `sensors` must have all those that the rule names.
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
