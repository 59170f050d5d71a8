// SPDX-License-Identifier: GPL-2.0-or-later
//
// The data topics of robots: when each has a message, and what is in it. Publishers are elsewhere.

#ifndef STAGE_ROS2_CPP_TOPICS_HH
#define STAGE_ROS2_CPP_TOPICS_HH

#include <builtin_interfaces/msg/time.hpp>
#include <memory>
#include <nav_msgs/msg/odometry.hpp>
#include <sensor_msgs/msg/battery_state.hpp>
#include <sensor_msgs/msg/camera_info.hpp>
#include <sensor_msgs/msg/image.hpp>
#include <sensor_msgs/msg/imu.hpp>
#include <sensor_msgs/msg/joint_state.hpp>
#include <sensor_msgs/msg/laser_scan.hpp>
#include <sensor_msgs/msg/range.hpp>
#include <std_msgs/msg/bool.hpp>
#include <std_msgs/msg/int64_multi_array.hpp>
#include <string>

#include "bodies.hh"
#include "motion.hh"
#include "robots.hh"

namespace stage_ros2_cpp {

using Stamp = builtin_interfaces::msg::Time;

/// Converts a time in microseconds.
Stamp StampOf(int64_t microseconds);

/// The objects that topics read, which outlive the topics.
struct Sources {
  Simulation& simulation;
  Bodies& bodies;
  Motion& motion;
};

/// A topic of a robot. It reads nothing before its first subscriber, because reading a sensor makes
/// it work. Times are in microseconds; `step` is the duration of the step that ended at `now`.
class Topic {
 public:
  Topic(const Sources& sources, size_t robot, std::string name)
      : name(std::move(name)), from_(sources), robot_(robot) {}
  virtual ~Topic() = default;

  const std::string name;  ///< with the robot's prefix
  virtual bool IsSensor() const { return false; }
  /// Starts reading the data from the world; further calls have no effect.
  virtual void Attach() {}
  /// True if there are new data.
  virtual bool IsDue(int64_t /*now*/, int64_t /*step*/) const { return true; }
  /// The time stamp of the data.
  virtual int64_t When(int64_t now, int64_t /*step*/) const { return now; }
  /// False if the robot is gone.
  bool Exists() const { return from_.bodies.Exists(robot_); }

 protected:
  const Sources from_;
  const size_t robot_;
};

/// A topic with messages of one type.
template <class M>
class TopicOf : public Topic {
 public:
  using Message = M;
  using Topic::Topic;
  /// Fills the message; false: there are no data yet.
  virtual bool Fill(const Stamp& stamp) = 0;
  const M& message() const { return message_; }

 protected:
  M message_;
};

/// A topic with the stamps of a robot's odometry.
template <class M>
class BodyTopic : public TopicOf<M> {
 public:
  using TopicOf<M>::TopicOf;
  bool IsDue(int64_t now, int64_t) const override { return When(now, 0) == now; }
  int64_t When(int64_t, int64_t) const override { return this->from_.bodies.Time(this->robot_); }
};

class OdometryTopic : public BodyTopic<nav_msgs::msg::Odometry> {
 public:
  /// `is_true`: true pose and velocity; otherwise those that the robot estimates.
  OdometryTopic(const Sources& sources, size_t robot, std::string name, bool is_true,
                const std::string& frame, const std::string& child);
  bool Fill(const Stamp& stamp) override;

 private:
  const bool is_true_;
};

class StallTopic : public TopicOf<std_msgs::msg::Bool> {
 public:
  using TopicOf::TopicOf;
  bool Fill(const Stamp& stamp) override;
};

class ImuTopic : public BodyTopic<sensor_msgs::msg::Imu> {
 public:
  ImuTopic(const Sources& sources, size_t robot, std::string name, const std::string& frame);
  void Attach() override { from_.motion.FollowBodies(); }
  bool Fill(const Stamp& stamp) override;
};

class JointsTopic : public BodyTopic<sensor_msgs::msg::JointState> {
 public:
  JointsTopic(const Sources& sources, size_t robot, std::string name);
  void Attach() override { from_.motion.FollowWheels(); }
  bool Fill(const Stamp& stamp) override;
};

class TicksTopic : public BodyTopic<std_msgs::msg::Int64MultiArray> {
 public:
  TicksTopic(const Sources& sources, size_t robot, std::string name, int64_t per_turn);
  void Attach() override { from_.motion.FollowWheels(); }
  bool Fill(const Stamp& stamp) override;

 private:
  const double per_radian_;
};

class BatteryTopic : public TopicOf<sensor_msgs::msg::BatteryState> {
 public:
  BatteryTopic(const Sources& sources, size_t robot, std::string name, double capacity);
  bool Fill(const Stamp& stamp) override;

 private:
  uint8_t StatusOf(double stored, bool infinite) const;
  const double capacity_;
  double before_;
};

/// A topic of a sensor, which updates in the first step at or after each multiple of its interval.
template <class M>
class SensorTopic : public TopicOf<M> {
 public:
  SensorTopic(const Sources& sources, size_t robot, std::string name, const Sensor& sensor)
      : TopicOf<M>(sources, robot, std::move(name)), sensor_(sensor) {}
  bool IsSensor() const override { return true; }
  bool IsDue(int64_t now, int64_t step) const override {
    return now / sensor_.interval != (now - step) / sensor_.interval;
  }
  int64_t When(int64_t now, int64_t step) const override {
    const Stg::Model* const model = IsDue(now, step) ? nullptr : Model();
    const auto last = model ? static_cast<int64_t>(model->GetLastUpdate()) : 0;
    return last != 0 ? last : now;
  }

 protected:
  Stg::Model* Model() const { return this->from_.simulation.Find(sensor_.model); }
  const Sensor sensor_;
};

/// A sensor of a ranger; `by_rep117`: ranges follow REP 117, otherwise they are Stage's own values.
template <class M>
class BeamsTopic : public SensorTopic<M> {
 public:
  BeamsTopic(const Sources& sources, size_t robot, const Sensor& sensor, bool by_rep117);
  void Attach() override { this->from_.simulation.AttachSensors("ranger", this->sensor_.index); }
  /// The time of the first ray.
  int64_t When(int64_t now, int64_t step) const override;

 protected:
  /// The sensor; null: it has not measured yet.
  const Stg::ModelRanger::Sensor* Measured() const;
  float Published(double range) const;

 private:
  const bool by_rep117_;
  const int64_t duration_;  // of a scan, microseconds
};

class ScanTopic : public BeamsTopic<sensor_msgs::msg::LaserScan> {
 public:
  ScanTopic(const Sources& sources, size_t robot, const Sensor& sensor, bool by_rep117);
  bool Fill(const Stamp& stamp) override;
};

class RangeTopic : public BeamsTopic<sensor_msgs::msg::Range> {
 public:
  RangeTopic(const Sources& sources, size_t robot, const Sensor& sensor, bool by_rep117);
  bool Fill(const Stamp& stamp) override;
};

class ImageTopic : public SensorTopic<sensor_msgs::msg::Image> {
 public:
  /// `is_depth`: depths as float32; otherwise colours.
  ImageTopic(const Sources& sources, size_t robot, std::string name, const Sensor& sensor,
             bool is_depth, bool by_rep117);
  void Attach() override { from_.simulation.AttachSensors("camera", sensor_.index); }
  bool Fill(const Stamp& stamp) override;

 private:
  void FillColors(const GLubyte* colors);
  void FillDepths(const GLfloat* depths);
  const bool is_depth_, by_rep117_;
};

class CameraInfoTopic : public SensorTopic<sensor_msgs::msg::CameraInfo> {
 public:
  CameraInfoTopic(const Sources& sources, size_t robot, std::string name, const Sensor& sensor);
  bool Fill(const Stamp& stamp) override;
};

/// Calls add(std::unique_ptr<T>) for each topic of a robot, where T is its class.
template <class F>
void MakeTopics(const Sources& sources, size_t robot, const RobotPlan& plan, const Look& look,
                F add) {
  const auto named = [&](const std::string& name) { return Joined(plan.prefix, name); };
  const std::string footprint = named(look.footprint);
  add(std::make_unique<OdometryTopic>(sources, robot, named("odom"), false, named(look.odom),
                                      footprint));
  add(std::make_unique<OdometryTopic>(sources, robot, named(look.scheme->ground_truth), true,
                                      look.map, footprint));
  add(std::make_unique<StallTopic>(sources, robot, named("stall")));
  add(std::make_unique<ImuTopic>(sources, robot, named("imu"), named(look.base)));
  if (!sources.motion.wheels(robot).names().empty()) {
    add(std::make_unique<JointsTopic>(sources, robot, named("joint_states")));
    add(std::make_unique<TicksTopic>(sources, robot, named("wheel_ticks"), look.ticks_per_turn));
  }
  for (const Sensor& sensor : plan.sensors) {
    if (sensor.kind == Sensor::kCamera) {
      const auto of_camera = [&](const char* name) { return named(name + sensor.topic); };
      add(std::make_unique<ImageTopic>(sources, robot, of_camera("image"), sensor, false,
                                       look.by_rep117));
      add(std::make_unique<ImageTopic>(sources, robot, of_camera("depth"), sensor, true,
                                       look.by_rep117));
      add(std::make_unique<CameraInfoTopic>(sources, robot, of_camera("camera_info"), sensor));
    } else if (sensor.scanner.samples == 1 && look.single_beams == "range") {
      add(std::make_unique<RangeTopic>(sources, robot, sensor, look.by_rep117));
    } else {
      add(std::make_unique<ScanTopic>(sources, robot, sensor, look.by_rep117));
    }
  }
  if (const Stg::PowerPack* const pack = sources.simulation.Robot(robot)->FindPowerPack())
    add(std::make_unique<BatteryTopic>(sources, robot, named("battery"), pack->GetCapacity()));
}

}  // namespace stage_ros2_cpp

#endif
