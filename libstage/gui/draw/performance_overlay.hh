// SPDX-License-Identifier: GPL-2.0-or-later
//
// Performance figures for the window's overlay: speed, and where the time of a step goes. They are
// averages over about the last half second.

#ifndef STAGE_GUI_DRAW_PERFORMANCE_OVERLAY_HH
#define STAGE_GUI_DRAW_PERFORMANCE_OVERLAY_HH

#include <cstdint>
#include <string>
#include <vector>

#include "world/statistics.hh"

namespace Stg {
class World;
}

namespace Stg::draw {

class PerformanceOverlay {
 public:
  /// Call once per frame. `now`: seconds of any steady clock.
  void Update(const World& world, double now);
  /// Starts a new measuring period, for example after a pause.
  void Restart() { started_ = false; }

  double frames_per_second() const { return frames_per_second_; }
  /// Simulated seconds per real second.
  double speed() const { return speed_; }
  /// Text of the overlay, line by line.
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  void Measure(const World& world, double seconds);

  bool started_ = false;
  double since_ = 0;
  unsigned frames_ = 0;
  uint64_t simulated_since_ = 0;
  RunStatistics before_;
  double frames_per_second_ = 0, speed_ = 0;
  std::vector<std::string> lines_;
};

}  // namespace Stg::draw

#endif
