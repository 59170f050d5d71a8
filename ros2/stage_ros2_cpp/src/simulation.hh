// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world and the robots in it.

#ifndef STAGE_ROS2_CPP_SIMULATION_HH
#define STAGE_ROS2_CPP_SIMULATION_HH

#include <cstdint>
#include <memory>
#include <optional>
#include <stage.hh>
#include <string>
#include <vector>

namespace stage_ros2_cpp {

/// Robots are the models that drive and stand on the ground, in the order of creation.
class Simulation {
 public:
  /// Loads a world file. Throws std::runtime_error with one line if that fails, or if there is no
  /// robot.
  explicit Simulation(const std::string& file);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  size_t size() const { return ids_.size(); }
  /// Null if the robot is gone.
  Stg::ModelPosition* Robot(size_t robot) const;
  /// The model with that id; null if it is gone.
  Stg::Model* Find(uint32_t id) const { return world_->FindModel(id); }

  int64_t Now() const;       ///< simulated time, microseconds
  int64_t StepTime() const;  ///< duration of a step, microseconds
  uint64_t seed() const { return world_->seed(); }
  std::string StateHash() const;  ///< 16 hexadecimal digits

  /// Applies the commands and makes a step; returns false if the world asks to quit. Throws what a
  /// controller throws, and std::runtime_error if one deletes the world.
  bool Step();
  /// Starts again at time 0, without commands. Throws std::runtime_error.
  void Reset(uint64_t seed);
  /// A robot obeys its own controller until its first command.
  void Command(size_t robot, const Stg::Velocity& velocity) { commands_[robot] = velocity; }
  /// Moves a robot, without a collision test.
  void Place(size_t robot, const Stg::Pose& pose);

  /// Subscribes to all robots, so that their odometry works.
  void AttachRobots();
  /// Subscribes to the sensor with that number of each robot; no effect if `type` is no sensor's.
  void AttachSensors(const std::string& type, size_t index);

 private:
  struct Attached {
    const Stg::ModelType* type;  // null: the robots themselves
    size_t index;
    bool operator==(const Attached& o) const { return type == o.type && index == o.index; }
  };
  void Attach(const Attached& what);
  void Subscribe(const Attached& what) const;
  void Restart(uint64_t seed);

  Stg::World* const world_;  // a controller may delete it
  std::vector<uint32_t> ids_;
  std::vector<std::optional<Stg::Velocity>> commands_;
  std::vector<Attached> attached_;  // in the order of subscription, which is part of the state
  std::shared_ptr<const Stg::InitialState> initial_state_;
  bool tried_initial_state_ = false;
};

}  // namespace stage_ros2_cpp

#endif
