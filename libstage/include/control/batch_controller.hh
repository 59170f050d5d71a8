// SPDX-License-Identifier: GPL-2.0-or-later
//
// BatchController: drives many robots by one call in each step, from arrays. A world whose
// controllers are all of this kind stays closed, so that thousands of worlds can be stepped without
// World objects; see WorldPool. Part of <stage.hh>; C++11.
//
// A plug-in exports its controller with STAGE_EXPORT_BATCH_CONTROLLER(Class) instead of Init(). A
// program registers it with RegisterBatchController().

#ifndef STAGE_CONTROL_BATCH_CONTROLLER_HH
#define STAGE_CONTROL_BATCH_CONTROLLER_HH

#include <stddef.h>
#include <stdint.h>

#include <memory>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "random/random.hh"

namespace Stg {

class ModelPosition;
class ModelRanger;

/// A pose in the plane.
struct PlanarPose {
  double x, y;  ///< m
  double a;     ///< rad
};

/// A velocity in the plane, in the robot's frame.
struct PlanarVelocity {
  double x, y;  ///< m/s, forward and to the left
  double a;     ///< rad/s
};

/// Base of the parameters that a controller has read for a robot. They never change, because the
/// robot shares them with its copies in other worlds.
class ControllerParameters {
 public:
  virtual ~ControllerParameters() {}
};

/// A sensor of a ranger that a controller uses, as it was after loading.
struct ControllerSensor {
  Pose pose;  ///< in the robot's frame
  radians_t fov;
  Bounds range;                  ///< m; readings are range.max where nothing was hit
  std::vector<double> bearings;  ///< rad relative to the sensor; ray 0 is at the right end
};

/// A robot, as it was after loading.
struct ControlledRobot {
  uint32_t id;                                             ///< Model::GetId()
  std::shared_ptr<const ControllerParameters> parameters;  ///< what Prepare() returned
  std::vector<ControllerSensor> sensors;                   ///< in the order of Use()
};

/// A named number among the arguments of a controller, given as NAME=NUMBER.
struct ControllerNumber {
  const char* name;
  double* value;  ///< holds the default and receives the number; NaN: the argument is required
  double min, max;
};

/// A robot that gets a controller. Functions that find a mistake throw std::runtime_error; loading
/// then fails with one line that gives the place, the controller, the robot, and the reason.
class ControllerSetup {
 public:
  /// `text` is the whole text of the property `ctrl`.
  ControllerSetup(ModelPosition* robot, const std::string& text);

  ModelPosition& robot() const { return *robot_; }
  /// The words after the name of the controller.
  const std::vector<std::string>& words() const { return words_; }
  /// Reads all words as numbers. Throws if a word is none of them.
  void ReadNumbers(const std::vector<ControllerNumber>& numbers) const;
  /// Subscribes to a ranger of the robot and adds its sensors to those that the controller reads.
  void Use(ModelRanger* ranger);
  /// The next ranger of the robot without subscribers; null if there is none.
  ModelRanger* FindUnusedRanger() const;

  const std::vector<ControllerSensor>& sensors() const { return sensors_; }
  const std::vector<ModelRanger*>& rangers() const { return rangers_; }

 private:
  ModelPosition* robot_;
  std::vector<std::string> words_;
  std::vector<ModelRanger*> rangers_;
  std::vector<ControllerSensor> sensors_;
};

/// The robots of one or several worlds for one step of a controller. Robot r of world w has the
/// index w * robots + r in arrays by world and robot. All worlds have the same robots.
///
/// Everything belongs to the instant at which the robots sensed, before the moves of the step;
/// `stalled` is the outcome of these moves.
struct ControllerBatch {
  size_t worlds, robots;
  size_t sensors;  ///< in a world, of all robots together
  /// In a world, those of other controllers included; 0: neither poses nor velocities were asked.
  size_t all_robots;

  // By robot.
  const ControlledRobot* const* robot;
  const uint32_t* first_sensor;  ///< index of its first sensor among those of a world
  const uint32_t* own;           ///< its index in all_poses

  const double* time;  ///< by world: simulated time, s

  // By world and robot.
  const PlanarPose* sensed;        ///< global
  const PlanarPose* estimate;      ///< see ModelPosition::est_pose
  const PlanarVelocity* velocity;  ///< in force, see ModelPosition::GetVelocity()
  const uint8_t* stalled;

  /// By world and sensor: the readings, as many as the sensor has bearings. Null if there are none.
  const double* const* ranges;
  const PlanarPose* all_poses;  ///< by world and robot of the world, global
  /// By world and robot of the world, in global directions; 0 for robots that are stalled or do not
  /// run. Null unless the controller needs them.
  const PlanarVelocity* all_velocities;

  // By world and robot: what the controller changes.
  PlanarVelocity* command;  ///< holds the present one; see ModelPosition::SetSpeed()
  double* memory;           ///< memory_size() numbers for each robot, see FillMemory()
  RandomStream* random;     ///< that of Model::random()

  /// The ranges of a sensor of a robot.
  const double* RangesOf(size_t world, size_t r, size_t sensor) const {
    return ranges[world * sensors + first_sensor[r] + sensor];
  }
};

/// A controller keeps nothing from one step to the next but what is in the arrays `memory` and
/// `random`, which are part of the state of a world: snapshots, copies and hashes have them.
/// Several threads may call it at once for different worlds.
class BatchController {
 public:
  virtual ~BatchController() {}
  /// Called once for each robot while a world is loaded: reads the arguments and chooses the
  /// sensors. The result, which may be null, is kept for Step(). The library subscribes to the
  /// robot.
  virtual std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const = 0;
  /// Called after the moves of each step in which robots of this controller updated, for these
  /// robots. Commands take effect in their next update.
  virtual void Step(const ControllerBatch& batch) const = 0;
  /// Number of doubles that the library keeps for each robot.
  virtual size_t memory_size() const { return 0; }
  /// True if the controller needs ControllerBatch::all_poses.
  virtual bool needs_poses() const { return false; }
  /// True if the controller needs ControllerBatch::all_velocities. It then gets all_poses, too.
  virtual bool needs_velocities() const { return false; }
  /// Sets the memory of a robot after loading. It is 0.
  virtual void FillMemory(const ControlledRobot& robot, double* memory) const {
    (void)robot;
    (void)memory;
  }
};

}  // namespace Stg

/// Exports a batch controller of a plug-in. `Class` is its class.
#define STAGE_EXPORT_BATCH_CONTROLLER(Class)                                    \
  extern "C" __attribute__((visibility("default"))) const Stg::BatchController* \
  StageBatchController() {                                                      \
    static const Class controller{};                                            \
    return &controller;                                                         \
  }

#endif
