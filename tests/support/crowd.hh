// SPDX-License-Identifier: GPL-2.0-or-later
//
// Crowds of robots whose sensors must sense the same however their rays are traced.

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
  std::string world;  ///< its text; the positions at top level are the robots
  int steps;
  double speed;  ///< m/s, of all robots
  /// rad/s, by the robot's number.
  std::function<double(size_t)> turn;
  /// Adds what the robots sense to a list, after each step.
  std::function<void(const Robots&, std::vector<double>*)> look;
};

struct Outcome {
  std::vector<double> sensed;
  std::vector<uint64_t> hashes;  ///< of the world's state, after each step
  uint64_t rays = 0;             ///< in all

  bool operator==(const Outcome&) const = default;
};

/// Runs the crowd with its rays in batches, one by one, in several threads, and on an OpenCL device
/// where there is one. Expects the same of all, and returns it.
Outcome ExpectSameHoweverItIsRun(const Crowd& crowd);

/// COUNT times what `text_of` gives for 0, 1, ...
std::string Repeat(int count, const std::function<std::string(int)>& text_of);

}  // namespace crowd

#endif
