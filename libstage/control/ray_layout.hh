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

class RayLayout {
 public:
  /// `first_rays`: index of the first ray of each sensor. Readings of `horizon` and above show
  /// nothing.
  RayLayout(const std::vector<ControllerSensor>& sensors, std::span<const uint32_t> first_rays,
            double horizon);

  const row_layout_t* record() const {
    return reinterpret_cast<const row_layout_t*>(words_.data());
  }
  /// The record and its parts.
  std::span<const uint64_t> words() const { return words_; }
  /// Sums over the sectors into which rays look.
  double cosines() const { return cosines_; }
  double sines() const { return sines_; }

 private:
  std::vector<uint64_t> words_;
  double cosines_ = 0, sines_ = 0;
};

/// The layout of sensors whose rays follow each other, shared by all robots that look alike.
/// Several threads may call it.
std::shared_ptr<const RayLayout> FindRayLayout(const std::vector<ControllerSensor>& sensors,
                                               double horizon);

}  // namespace Stg::control

#endif
