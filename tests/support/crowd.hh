// SPDX-License-Identifier: GPL-2.0-or-later
//
// Crowds of robots for tests that all ways to trace rays give the same readings.

#ifndef STAGE_TESTS_SUPPORT_CROWD_HH
#define STAGE_TESTS_SUPPORT_CROWD_HH

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "stage.hh"

namespace crowd {

using Robots = std::vector<Stg::ModelPosition*>;

struct Crowd {
  std::string world;  ///< the world file's text; position models at top level are the robots
  int steps;
  double speed;  ///< forward speed of all robots, m/s
  /// Turn rate (rad/s) by the robot's index.
  std::function<double(size_t)> turn;
  /// Appends the robots' readings to a list; called after each step.
  std::function<void(const Robots&, std::vector<double>*)> look;
};

struct Outcome {
  std::vector<double> sensed;
  std::vector<uint64_t> hashes;  ///< state hash after each step
  uint64_t rays = 0;             ///< total number of rays

  bool operator==(const Outcome&) const = default;
};

/// Runs the crowd with rays in batches, one by one, on several threads, and on an OpenCL device if
/// there is one. Expects equal outcomes and returns the outcome.
Outcome ExpectSameHoweverItIsRun(const Crowd& crowd);

/// Concatenates text_of(0) to text_of(count - 1).
std::string Repeat(int count, const std::function<std::string(int)>& text_of);

}  // namespace crowd

#endif
