// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the sensors of a robot look: unit vectors of their rays, and the sectors into which they
// look.

#ifndef STAGE_CONTROL_RAY_LAYOUT_HH
#define STAGE_CONTROL_RAY_LAYOUT_HH

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "control/batch_controller.hh"
#include "kernels/row_control.h"

namespace Stg::control {

struct RayLayout {
  std::vector<row_eye_t> eyes;  ///< by sensor
  std::vector<row_sector_t> sectors;
  std::vector<row_run_t> runs;
  std::vector<row_turn_t> directions;  ///< by ray
  double cosines = 0, sines = 0;       ///< of the sectors: sums

  /// `first_rays`: index of the first ray of each sensor. Readings of `horizon` and above show
  /// nothing.
  RayLayout(const std::vector<ControllerSensor>& sensors, std::span<const uint32_t> first_rays,
            double horizon);

  row_layout_t View() const {
    return {eyes.data(),
            sectors.data(),
            runs.data(),
            directions.data(),
            static_cast<ray_uint>(eyes.size()),
            static_cast<ray_uint>(sectors.size())};
  }

 private:
  void AddSensor(const ControllerSensor& sensor, uint32_t first_ray, double horizon,
                 std::vector<row_run_t>* of_sectors);
};

/// The layout of sensors whose rays follow each other, shared by all robots that look alike.
/// Several threads may call it.
std::shared_ptr<const RayLayout> FindRayLayout(const std::vector<ControllerSensor>& sensors,
                                               double horizon);

}  // namespace Stg::control

#endif
