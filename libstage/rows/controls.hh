// SPDX-License-Identifier: GPL-2.0-or-later
//
// Batch controllers in rows. Part of scene.hh.

#ifndef STAGE_ROWS_CONTROLS_HH
#define STAGE_ROWS_CONTROLS_HH

#include <cstdint>
#include <vector>

#include "control/batch_controller.hh"

namespace Stg::rows {

/// A robot that a batch controller drives.
struct Control {
  static constexpr uint32_t kNoRays = UINT32_MAX;
  uint32_t mover;
  const ControlledRobot* robot;      ///< of the prototype
  std::vector<uint32_t> first_rays;  ///< by sensor, among those of a world; kNoRays: it has none
  std::vector<uint32_t> rates;       ///< by sensor, in Scene::rates
};

/// Robots that are driven by the same call, see DrivenGroup.
struct ControlGroup {
  const BatchController* controller;
  std::vector<Control> controls;
  uint32_t first_memory, memory_size;  ///< among the doubles of a world; of a robot
  uint32_t rates = 0;                  ///< of the robots, as bits

  // Arrays of ControllerBatch.
  std::vector<const ControlledRobot*> robot;
  std::vector<uint32_t> first_sensor, own;
  std::vector<uint32_t> everyone;  ///< numbers of all controls
  uint32_t sensors = 0;
};

struct Controls {
  std::vector<ControlGroup> groups;
  uint32_t memory_count = 0;        ///< doubles of a world
  std::vector<uint32_t> positions;  ///< all movers that are robots, if poses are needed
};

/// Memory for a call of a controller.
struct ControlBuffers {
  // For a call with some robots of a group; the group has these arrays for all of its robots.
  std::vector<uint32_t> some, first_sensor, own;
  std::vector<const ControlledRobot*> robot;
  std::vector<double> memory;
  std::vector<PlanarPose> sensed, estimate, all_poses;
  std::vector<PlanarVelocity> velocity, command, all_velocities;
  std::vector<uint8_t> stalled;
  std::vector<const double*> ranges;
  std::vector<RandomStream> random;

  explicit ControlBuffers(const Controls& controls);
};

}  // namespace Stg::rows

#endif
