// SPDX-License-Identifier: GPL-2.0-or-later
//
// Calls of a rule for the robots of a batch.

#ifndef STAGE_CONTROL_STOCK_BATCH_HH
#define STAGE_CONTROL_STOCK_BATCH_HH

#include <cstddef>
#include <cstring>
#include <vector>

#include "control/batch_controller.hh"
#include "control/stock_controllers.hh"
#include "kernels/row_control.h"

namespace Stg::control {

static_assert(sizeof(RandomStream) == sizeof(row_random_t));
static_assert(sizeof(PlanarPose) == sizeof(row_planar_t));
static_assert(sizeof(PlanarVelocity) == sizeof(row_planar_t));

/// A robot of a batch.
struct InBatch {
  const ControllerBatch& batch;
  size_t world, robot;

  size_t index() const { return world * batch.robots + robot; }
  const ControlledRobot& of() const { return *batch.robot[robot]; }
  const StockParameters& parameters() const {
    return static_cast<const StockParameters&>(*of().parameters);
  }
  /// The controller needs poses or velocities.
  row_company_t all() const {
    const size_t first = world * batch.all_robots;
    const auto* const v = batch.all_velocities ? batch.all_velocities + first : nullptr;
    return {reinterpret_cast<const row_planar_t*>(batch.all_poses + first),
            reinterpret_cast<const row_planar_t*>(v), static_cast<ray_uint>(batch.all_robots),
            batch.own[robot]};
  }
  row_planar_t estimate() const {
    const PlanarPose& at = batch.estimate[index()];
    return {at.x, at.y, at.a};
  }
};

/// Calls drive(InBatch, row_planar_t* command) for all robots of a batch.
template <typename F>
void DriveAll(const ControllerBatch& batch, F drive) {
  for (size_t world = 0; world < batch.worlds; world++)
    for (size_t robot = 0; robot < batch.robots; robot++) {
      const InBatch at{batch, world, robot};
      PlanarVelocity& to = batch.command[at.index()];
      row_planar_t command = {to.x, to.y, to.a};
      drive(at, &command);
      to = {command.x, command.y, command.a};
    }
}

/// The readings of all sensors of a robot, one after the other: where they are, or copied into the
/// buffer. Null if a sensor has none.
inline const double* ReadingsOf(const InBatch& at, std::vector<double>* buffer) {
  const std::vector<ControllerSensor>& sensors = at.of().sensors;
  const double* first = nullptr;
  size_t rays = 0;
  bool is_in_order = true;
  for (size_t s = 0; s < sensors.size(); s++) {
    const size_t count = sensors[s].bearings.size();
    if (count == 0) continue;
    const double* const ranges = at.batch.RangesOf(at.world, at.robot, s);
    if (!ranges) return nullptr;
    if (!first) first = ranges;
    is_in_order = is_in_order && ranges == first + rays;
    rays += count;
  }
  if (is_in_order && first) return first;
  buffer->resize(rays + 1);  // never null
  rays = 0;
  for (size_t s = 0; s < sensors.size(); s++) {
    const size_t count = sensors[s].bearings.size();
    if (count == 0) continue;
    std::memcpy(buffer->data() + rays, at.batch.RangesOf(at.world, at.robot, s),
                count * sizeof(double));
    rays += count;
  }
  return buffer->data();
}

/// Calls drive(InBatch, readings, row_planar_t* command) for all robots of a batch whose sensors
/// have readings; see ReadingsOf().
template <typename F>
void DriveAllByReadings(const ControllerBatch& batch, F drive) {
  static thread_local std::vector<double> buffer;
  DriveAll(batch, [&](const InBatch& at, row_planar_t* command) {
    if (const double* const ranges = ReadingsOf(at, &buffer)) drive(at, ranges, command);
  });
}

}  // namespace Stg::control

#endif
