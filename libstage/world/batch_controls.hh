// SPDX-License-Identifier: GPL-2.0-or-later
//
// The batch controllers of a world, and the robots that they drive.

#ifndef STAGE_WORLD_BATCH_CONTROLS_HH
#define STAGE_WORLD_BATCH_CONTROLS_HH

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "control/batch_controller.hh"
#include "models/model.hh"

namespace Stg {

class WorldEngine;

/// Argument of the CB_INIT callback that gives a robot its batch controller.
struct BatchArguments {
  WorldEngine* engine;
  const BatchController* controller;
  std::string name;  ///< of the controller
  std::string text;  ///< of `ctrl`
};

/// A robot with a batch controller. The model owns it.
struct DrivenRobot {
  /// A sensor that the controller reads.
  struct SensorPlace {
    uint32_t id;                ///< of the ranger
    uint32_t index;             ///< in the ranger
    const ModelRanger* ranger;  ///< null if it has been deleted
  };
  /// Controllers of a robot are called in the order of `ctrl`. All robots for which a controller
  /// has the same number there form a group.
  unsigned number;
  std::string name;  ///< of the controller
  const BatchController* controller;
  ModelPosition* model;
  ControlledRobot robot;
  std::vector<SensorPlace> sensors;  ///< as in `robot`
  std::vector<double> memory;
};

/// Robots that are driven by the same call.
struct DrivenGroup {
  const BatchController* controller;
  std::vector<DrivenRobot*> robots;  ///< in the order of creation
};

/// All robots of a world, as far as a controller needs them.
struct AllRobots {
  std::vector<PlanarPose> poses;
  std::vector<PlanarVelocity> velocities;
};

/// Memory for the arrays of a call.
struct BatchBuffers {
  std::vector<const ControlledRobot*> robot;
  std::vector<uint32_t> first_sensor, own;
  std::vector<PlanarPose> sensed, estimate;
  std::vector<PlanarVelocity> velocity, command;
  std::vector<uint8_t> stalled;
  std::vector<const double*> ranges;
  std::vector<double> memory;
  std::vector<RandomStream> random;

  void Clear();
  /// A batch of one world with these arrays.
  ControllerBatch Batch(const double* time, const AllRobots& all);
};

class BatchControls {
 public:
  /// Gives a robot the controller of these arguments. Throws what Prepare() throws, and
  /// std::runtime_error if the model is no position.
  void Attach(Model* model, const BatchArguments& arguments);
  /// Calls the controllers of the robots that updated at this time, and passes on their commands.
  void Run(WorldEngine* engine, usec_t now);
  /// The groups in the order of their calls.
  const std::vector<DrivenGroup>& Groups(const WorldEngine& engine) const;

 private:
  void Refresh(const WorldEngine& engine) const;
  void RunGroup(const DrivenGroup& group, WorldEngine* engine, usec_t now);
  void Call(const BatchController& controller, std::span<DrivenRobot* const> robots, double time,
            BatchBuffers* buffers) const;
  void Gather(const DrivenRobot& driven, BatchBuffers* to) const;
  void CollectAll(const BatchController& controller);
  static void Apply(const ControllerBatch& batch, std::span<DrivenRobot* const> robots);

  // Mutable: members that Refresh() finds in the world.
  mutable std::vector<std::weak_ptr<DrivenRobot>> all_;
  mutable uint64_t topology_version_ = 0;  // of the engine when `groups_` was made
  mutable std::vector<DrivenGroup> groups_;
  mutable std::vector<ModelPosition*> positions_;  // of the world
  std::vector<DrivenRobot*> due_;                  // in the present call
  AllRobots all_robots_;                           // for it
  std::vector<BatchBuffers> buffers_;              // by thread
};

}  // namespace Stg

#endif
