// SPDX-License-Identifier: GPL-2.0-or-later
//
// The node: a world, the topics of its robots, and services such as reset, pause and step.

#ifndef STAGE_ROS2_CPP_NODE_HH
#define STAGE_ROS2_CPP_NODE_HH

#include <chrono>
#include <functional>
#include <geometry_msgs/msg/pose_stamped.hpp>
#include <geometry_msgs/msg/twist.hpp>
#include <geometry_msgs/msg/twist_stamped.hpp>
#include <memory>
#include <optional>
#include <rclcpp/rclcpp.hpp>
#include <rosgraph_msgs/msg/clock.hpp>
#include <std_srvs/srv/empty.hpp>
#include <std_srvs/srv/set_bool.hpp>
#include <std_srvs/srv/trigger.hpp>
#include <string>
#include <tf2_msgs/msg/tf_message.hpp>
#include <vector>

#include "frames.hh"
#include "pace.hh"
#include "topics.hh"
#include "transforms.hh"

namespace stage_ros2_cpp {

/// A timer makes the steps. All callbacks are in one mutually exclusive group, so commands take
/// effect between steps, in the order of arrival, whatever executor there is.
class StageNode : public rclcpp::Node {
 public:
  /// Throws std::invalid_argument or std::runtime_error with one line if a parameter or the world
  /// is invalid.
  explicit StageNode(const rclcpp::NodeOptions& options);

 private:
  using Clock = std::chrono::steady_clock;
  /// A topic with its publisher.
  struct Feed {
    std::unique_ptr<Topic> topic;
    std::function<size_t()> count_subscribers;
    std::function<void(const Stamp&)> publish;
    bool attached = false, active = false;
  };

  std::string Text(const std::string& name) const { return get_parameter(name).as_string(); }
  bool Flag(const std::string& name) const { return get_parameter(name).as_bool(); }
  Look LookByParameters() const;
  std::vector<Wheels> WheelsByParameters() const;

  void MakeFeeds();
  template <class T>
  void AddFeed(std::unique_ptr<T> topic, const rclcpp::QoS& sensor_qos);
  void MakeTransforms();
  void MakeSubscriptions();
  void MakeServices();

  void Publish(bool everything);
  void Send(const std::vector<Feed*>& feeds, bool everything);
  void TellTime();
  /// Looks for subscribers once per period; returns the feeds that have got their first one.
  std::vector<Feed*> CheckSubscribers();
  void PublishToNewSubscribers();

  void Command(size_t robot, const geometry_msgs::msg::Twist& twist);
  void Teleport(size_t robot, const geometry_msgs::msg::PoseStamped& message);
  void OnMoved();
  void RunWatchdog();

  void Pause(bool on);
  std::string Reset();
  std::string MakeSteps();
  void ResetPositions();
  void AttachAll();
  void OnWorldReset();

  bool Advance();
  void Turn();
  void Schedule();

  // The order is that of construction: later members refer to earlier ones.
  OnSetParametersCallbackHandle::SharedPtr parameter_check_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<Bodies> bodies_;
  std::unique_ptr<Motion> motion_;
  Look look_;
  std::vector<RobotPlan> plans_;
  std::unique_ptr<Frames> frames_;
  std::unique_ptr<Transforms> transforms_;
  std::unique_ptr<Pace> pace_;

  std::vector<Feed> feeds_;
  std::vector<Stg::Pose> home_;                // start poses
  std::vector<std::optional<int64_t>> heard_;  // time of the last command, microseconds
  bool paused_ = false, ended_ = false, tf_active_ = false;
  int64_t published_ = -1;  // the last time on /clock, microseconds
  std::optional<Clock::time_point> last_look_;

  rclcpp::Publisher<rosgraph_msgs::msg::Clock>::SharedPtr clock_;
  rclcpp::Publisher<tf2_msgs::msg::TFMessage>::SharedPtr tf_, tf_static_;
  std::vector<rclcpp::SubscriptionBase::SharedPtr> subscriptions_;
  std::vector<rclcpp::ServiceBase::SharedPtr> services_;
  rclcpp::TimerBase::SharedPtr timer_;
  std::chrono::nanoseconds timer_period_{-1};
};

}  // namespace stage_ros2_cpp

#endif
