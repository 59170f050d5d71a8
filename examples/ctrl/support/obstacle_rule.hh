// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drives about without collisions, with one laser-like sensor: straight ahead while the way is
// free, otherwise a turn to the freer side for a random time.

#ifndef EXAMPLES_CTRL_SUPPORT_OBSTACLE_RULE_HH
#define EXAMPLES_CTRL_SUPPORT_OBSTACLE_RULE_HH

#include <algorithm>
#include <optional>
#include <vector>

#include "stage.hh"

namespace ctrl {

struct ObstacleRule {
  size_t window_divisor = 3;    ///< all samples but 1/window_divisor at either end count as ahead
  double front_distance = 1.0;  ///< m; avoid things ahead that are nearer
  double stop_distance = 0.3;   ///< m; stop if anything is nearer
  double cruise_speed = 0.4;    ///< m/s
  double avoid_speed = 0.05;    ///< m/s
  double avoid_turn = 0.5;      ///< rad/s
  int avoid_duration = 10;      ///< n: a turn lasts n to 2n - 1 updates
};

struct ObstacleState {
  int avoid_count = 0;  ///< remaining updates of the present turn

  void ExchangeState(Stg::StateExchange& exchange) { exchange(avoid_count); }
};

struct ObstacleCommand {
  double forward;              ///< m/s
  std::optional<double> turn;  ///< rad/s; none: keep turning as before
  bool avoiding;
};

/// Summary of the ranges; sample 0 is the rightmost.
struct ObstacleView {
  bool obstructed = false, stop = false;
  double min_left = 1e6, min_right = 1e6;
};

inline ObstacleView LookForObstacles(const std::vector<double>& ranges, const ObstacleRule& rule) {
  ObstacleView view;
  const size_t count = ranges.size();
  const size_t side = count / rule.window_divisor;
  for (size_t i = 0; i < count; i++) {
    if (i > side && i < count - side && ranges[i] < rule.front_distance) view.obstructed = true;
    if (ranges[i] < rule.stop_distance) view.stop = true;
    double& nearest = i > count / 2 ? view.min_left : view.min_right;
    nearest = std::min(nearest, ranges[i]);
  }
  return view;
}

/// Computes one update; returns nothing if there are no ranges. At the start of a turn, it calls
/// `draw` once with a number of choices, which returns the index of one.
template <class Draw>
std::optional<ObstacleCommand> AvoidObstacles(const std::vector<double>& ranges,
                                              const ObstacleRule& rule, ObstacleState* state,
                                              Draw draw) {
  if (ranges.empty()) return std::nullopt;
  const ObstacleView view = LookForObstacles(ranges, rule);
  if (!view.obstructed && !view.stop && state->avoid_count <= 0) {
    state->avoid_count = 0;
    return ObstacleCommand{rule.cruise_speed, 0.0, false};
  }
  ObstacleCommand command{view.stop ? 0.0 : rule.avoid_speed, std::nullopt, true};
  if (state->avoid_count < 1) {
    const unsigned choices = static_cast<unsigned>(rule.avoid_duration);
    state->avoid_count = rule.avoid_duration + static_cast<int>(draw(choices));
    command.turn = view.min_left < view.min_right ? -rule.avoid_turn : rule.avoid_turn;
  }
  state->avoid_count--;
  return command;
}

}  // namespace ctrl

#endif
