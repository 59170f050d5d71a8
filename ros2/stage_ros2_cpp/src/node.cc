// SPDX-License-Identifier: GPL-2.0-or-later

#include "node.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <rclcpp_components/register_node_macro.hpp>
#include <stdexcept>
#include <utility>

#include "parameters.hh"

namespace stage_ros2_cpp {

using geometry_msgs::msg::PoseStamped;
using geometry_msgs::msg::Twist;
using geometry_msgs::msg::TwistStamped;
using std_srvs::srv::Empty;
using std_srvs::srv::SetBool;
using std_srvs::srv::Trigger;
using tf2_msgs::msg::TFMessage;

namespace {

/// Real time between looks for subscribers.
constexpr std::chrono::milliseconds kListenersPeriod{100};
/// Real time after which other callbacks get their turn, even if steps are due.
constexpr std::chrono::milliseconds kSlice{20};
constexpr std::chrono::nanoseconds kPausedPeriod{50000000}, kMinPeriod{100000}, kMaxPeriod{5000000};

rclcpp::PublisherOptions WithOverrides() {
  rclcpp::PublisherOptions options;
  options.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies();
  return options;
}

std::string TextOf(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", number);
  return text;
}

}  // namespace

StageNode::StageNode(const rclcpp::NodeOptions& options) : rclcpp::Node("stage", options) {
  DeclareParameters(this);
  parameter_check_ = add_on_set_parameters_callback(CheckChanges);
  const std::string file = Text("world_file");
  if (file.empty())
    throw std::invalid_argument("found no world, expected one in the parameter world_file");
  simulation_ = std::make_unique<Simulation>(file);
  for (size_t i = 0; i < simulation_->size(); i++)
    home_.push_back(simulation_->Robot(i)->GetGlobalPose());
  heard_.resize(simulation_->size());
  bodies_ = std::make_unique<Bodies>(*simulation_);
  look_ = LookByParameters();
  motion_ = std::make_unique<Motion>(*bodies_, WheelsByParameters(),
                                     static_cast<double>(simulation_->StepTime()) / 1e6);
  plans_ = PlanRobots(*simulation_, look_);
  frames_ = std::make_unique<Frames>(look_, plans_, *simulation_);
  paused_ = Flag("paused");
  pace_ = std::make_unique<Pace>(NumberOf(*this, "speed"), !paused_);
  MakeFeeds();
  if (Flag("publish_tf")) MakeTransforms();
  MakeSubscriptions();
  MakeServices();
  OnWorldReset();
  Schedule();
  RCLCPP_INFO(get_logger(), "%s: %zu robots, %zu topics", file.c_str(), simulation_->size(),
              feeds_.size());
}

Look StageNode::LookByParameters() const {
  return {FindScheme(Text("naming")),
          Flag("enforce_prefixes"),
          Text("odom_frame_id"),
          Text("base_link_frame_id"),
          Text("base_footprint_frame_id"),
          Text("map_frame_id"),
          Text("single_beams"),
          Text("ranges") == "rep117",
          get_parameter("ticks_per_turn").as_int()};
}

std::vector<Wheels> StageNode::WheelsByParameters() const {
  std::vector<Wheels> wheels;
  for (size_t i = 0; i < simulation_->size(); i++)
    wheels.emplace_back(*simulation_->Robot(i), NumberOf(*this, "wheel_radius"),
                        NumberOf(*this, "wheel_separation"));
  return wheels;
}

// ---- publishing ---------------------------------------------------------------------------------

template <class T>
void StageNode::AddFeed(std::unique_ptr<T> topic, const rclcpp::QoS& sensor_qos) {
  using Message = typename T::Message;
  const auto publisher = create_publisher<Message>(
      topic->name, topic->IsSensor() ? sensor_qos : rclcpp::QoS(10), WithOverrides());
  Feed feed;
  feed.count_subscribers = [publisher] { return publisher->get_subscription_count(); };
  feed.publish = [publisher, data = topic.get()](const Stamp& stamp) {
    if (data->Fill(stamp)) publisher->publish(data->message());
  };
  feed.topic = std::move(topic);
  feeds_.push_back(std::move(feed));
}

void StageNode::MakeFeeds() {
  rclcpp::QoS sensor_qos(5);
  if (Text("sensor_qos") == "best_effort") sensor_qos.best_effort();
  const Sources sources{*simulation_, *bodies_, *motion_};
  for (size_t i = 0; i < plans_.size(); i++)
    MakeTopics(sources, i, plans_[i], look_,
               [&](auto topic) { AddFeed(std::move(topic), sensor_qos); });
  clock_ = create_publisher<rosgraph_msgs::msg::Clock>("/clock", rclcpp::QoS(10));
}

void StageNode::MakeTransforms() {
  transforms_ = std::make_unique<Transforms>(look_, plans_, *simulation_, *bodies_, *frames_,
                                             Flag("publish_map_tf"));
  tf_ = create_publisher<TFMessage>("/tf", rclcpp::QoS(100), WithOverrides());
  rclcpp::PublisherOptions options;
  // Some releases refuse kept messages within a process.
  options.use_intra_process_comm = rclcpp::IntraProcessSetting::Disable;
  tf_static_ = create_publisher<TFMessage>("/tf_static", rclcpp::QoS(1).transient_local(), options);
  tf_static_->publish(StaticTransforms(plans_));
}

void StageNode::Publish(bool everything) {
  CheckSubscribers();
  const int64_t now = simulation_->Now(), step = simulation_->StepTime();
  std::vector<Feed*> due;
  for (Feed& feed : feeds_)
    if (feed.active && (everything || feed.topic->IsDue(now, step))) due.push_back(&feed);
  Send(due, everything);
}

/// Publishes the time, then transforms, then data, so that a stamp's time and frames precede its
/// data.
void StageNode::Send(const std::vector<Feed*>& feeds, bool everything) {
  const int64_t now = simulation_->Now(), step = simulation_->StepTime();
  TellTime();
  if (tf_active_) {
    const TFMessage message = transforms_->At(now, everything);
    if (!message.transforms.empty()) tf_->publish(message);
  }
  for (Feed* const feed : feeds)
    if (feed->topic->Exists()) feed->publish(StampOf(feed->topic->When(now, step)));
}

void StageNode::TellTime() {
  published_ = std::max(simulation_->Now(), published_);
  rosgraph_msgs::msg::Clock message;
  message.clock = StampOf(published_);
  clock_->publish(message);
}

std::vector<StageNode::Feed*> StageNode::CheckSubscribers() {
  const Clock::time_point now = Clock::now();
  if (last_look_ && now - *last_look_ < kListenersPeriod) return {};
  last_look_ = now;
  tf_active_ = tf_ && tf_->get_subscription_count() > 0;
  std::vector<Feed*> found;
  for (Feed& feed : feeds_) {
    const bool listened = feed.count_subscribers() > 0;
    if (listened && !feed.active) {
      if (!std::exchange(feed.attached, true)) feed.topic->Attach();
      found.push_back(&feed);
    }
    feed.active = listened;
  }
  return found;
}

void StageNode::PublishToNewSubscribers() {
  const std::vector<Feed*> found = CheckSubscribers();
  if (!found.empty()) Send(found, true);
}

// ---- subscriptions ------------------------------------------------------------------------------

void StageNode::MakeSubscriptions() {
  const bool stamped = Flag("stamped_cmd_vel");
  const rclcpp::QoS qos(10);
  for (size_t i = 0; i < plans_.size(); i++) {
    const std::string cmd_vel = Joined(plans_[i].prefix, "cmd_vel");
    if (stamped)
      subscriptions_.push_back(create_subscription<TwistStamped>(
          cmd_vel, qos, [this, i](const TwistStamped& message) { Command(i, message.twist); }));
    else
      subscriptions_.push_back(create_subscription<Twist>(
          cmd_vel, qos, [this, i](const Twist& message) { Command(i, message); }));
    subscriptions_.push_back(create_subscription<PoseStamped>(
        Joined(plans_[i].prefix, "teleport"), qos,
        [this, i](const PoseStamped& message) { Teleport(i, message); }));
  }
}

void StageNode::Command(size_t robot, const Twist& twist) {
  const double ahead = twist.linear.x, left = twist.linear.y, turn = twist.angular.z;
  if (!std::isfinite(ahead) || !std::isfinite(left) || !std::isfinite(turn)) {
    RCLCPP_WARN_THROTTLE(get_logger(), *get_clock(), 5000,
                         "'%s': found the speeds (%g, %g, %g), expected finite numbers",
                         plans_[robot].name.c_str(), ahead, left, turn);
    return;
  }
  simulation_->Command(robot, Stg::Velocity(ahead, left, 0, turn));
  heard_[robot] = simulation_->Now();
}

void StageNode::Teleport(size_t robot, const PoseStamped& message) {
  const auto& place = message.pose.position;
  const auto& turn = message.pose.orientation;
  const char* const name = plans_[robot].name.c_str();
  const Stg::Pose pose(place.x, place.y, 0, HeadingOf(turn.x, turn.y, turn.z, turn.w));
  if (!std::isfinite(pose.x) || !std::isfinite(pose.y) || !std::isfinite(pose.a)) {
    RCLCPP_WARN(get_logger(), "'%s': found the pose (%g, %g, %g), expected finite numbers", name,
                pose.x, pose.y, pose.a);
    return;
  }
  try {
    simulation_->Place(robot, frames_->InWorld(pose, message.header.frame_id));
  } catch (const std::invalid_argument& error) {
    RCLCPP_WARN(get_logger(), "'%s': not put elsewhere: %s", name, error.what());
    return;
  }
  OnMoved();
}

/// Called when a client has moved robots. While paused, the new poses are published at once.
void StageNode::OnMoved() {
  bodies_->MarkMoved();
  if (paused_) Publish(true);
}

/// Stops robots whose last command is older than `base_watchdog_timeout`.
void StageNode::RunWatchdog() {
  const double patience = NumberOf(*this, "base_watchdog_timeout") * 1e6;
  if (!(patience > 0)) return;
  for (size_t i = 0; i < heard_.size(); i++)
    if (heard_[i] && static_cast<double>(simulation_->Now() - *heard_[i]) > patience)
      simulation_->Command(i, Stg::Velocity(0, 0, 0, 0));
}

// ---- services -----------------------------------------------------------------------------------

void StageNode::MakeServices() {
  services_.push_back(create_service<Empty>(
      "/reset_positions", [this](const std::shared_ptr<Empty::Request>,
                                 std::shared_ptr<Empty::Response>) { ResetPositions(); }));
  services_.push_back(
      create_service<SetBool>("~/pause", [this](const std::shared_ptr<SetBool::Request> request,
                                                std::shared_ptr<SetBool::Response> response) {
        Pause(request->data);
        response->success = true;
        response->message = paused_ ? "paused" : "running";
      }));
  const auto add = [this](const char* name, std::string (StageNode::*does)()) {
    services_.push_back(
        create_service<Trigger>(name, [this, does](const std::shared_ptr<Trigger::Request>,
                                                   std::shared_ptr<Trigger::Response> response) {
          try {
            response->message = (this->*does)();
            response->success = true;
          } catch (const std::exception& error) {
            response->success = false;
            response->message = error.what();
          }
        }));
  };
  add("~/reset", &StageNode::Reset);
  add("~/step", &StageNode::MakeSteps);
}

/// Moves robots back to their start poses and stops them, as stage_ros does; time goes on.
void StageNode::ResetPositions() {
  for (size_t i = 0; i < home_.size(); i++) {
    simulation_->Place(i, home_[i]);
    if (heard_[i]) simulation_->Command(i, Stg::Velocity(0, 0, 0, 0));
  }
  OnMoved();
}

void StageNode::Pause(bool on) {
  paused_ = on;
  pace_->SetRunning(!on);
  Schedule();
}

std::string StageNode::Reset() {
  const int64_t seed = get_parameter("seed").as_int();
  simulation_->Reset(seed < 0 ? simulation_->seed() : static_cast<uint64_t>(seed));
  ended_ = false;
  std::fill(heard_.begin(), heard_.end(), std::nullopt);
  OnWorldReset();
  return "began anew with the seed " + std::to_string(simulation_->seed());
}

std::string StageNode::MakeSteps() {
  Pause(true);
  const int64_t wanted = get_parameter("steps").as_int();
  int64_t made = 0;
  while (made < wanted && rclcpp::ok() && Advance()) made++;
  return "made " + std::to_string(made) + " steps: time " +
         TextOf(static_cast<double>(simulation_->Now()) / 1e6) + ", state " +
         simulation_->StateHash();
}

void StageNode::AttachAll() {
  for (const RobotPlan& plan : plans_)
    for (const auto& [type, index] : plan.all_sensors) simulation_->AttachSensors(type, index);
  for (Feed& feed : feeds_)
    if (!std::exchange(feed.attached, true)) feed.topic->Attach();
}

/// Called after loading and after a reset.
void StageNode::OnWorldReset() {
  // Attach sensors before robots: the order of subscriptions is part of the state.
  if (Flag("always_on")) AttachAll();
  simulation_->AttachRobots();
  bodies_->Begin();
  motion_->Begin();
  pace_->Begin();
  published_ = -1;
  Publish(true);
}

// ---- time ---------------------------------------------------------------------------------------

/// Makes a step and publishes the new data; returns false if the world has ended.
bool StageNode::Advance() {
  RunWatchdog();
  const bool made = simulation_->Step();
  ended_ = !made;
  bodies_->Step();
  motion_->Step();
  if (made) Publish(false);
  return made;
}

/// The timer's callback: makes the steps that are due.
void StageNode::Turn() {
  Schedule();
  if (paused_) return PublishToNewSubscribers();
  if (ended_) return;
  const double dt = static_cast<double>(simulation_->StepTime()) / 1e6;
  const Clock::time_point start = Clock::now();
  try {
    while (pace_->IsDue(dt) && Clock::now() - start < kSlice) {
      pace_->Made(dt);
      if (!Advance() || pace_->IsUnlimited()) break;
    }
  } catch (const std::exception& error) {
    RCLCPP_ERROR(get_logger(), "paused: %s", error.what());
    Pause(true);
  }
}

/// Sets the period of the timer: a fraction of a step in real time.
void StageNode::Schedule() {
  const double speed = NumberOf(*this, "speed");
  pace_->SetSpeed(speed);
  std::chrono::nanoseconds period(0);
  if (paused_ || ended_) {
    period = kPausedPeriod;
  } else if (!pace_->IsUnlimited()) {
    const double step = static_cast<double>(simulation_->StepTime()) * 1e3 / speed;  // nanoseconds
    period = std::clamp(std::chrono::nanoseconds(static_cast<int64_t>(std::min(step, 1e9) / 4)),
                        kMinPeriod, kMaxPeriod);
  }
  if (period == timer_period_) return;
  timer_period_ = period;
  if (timer_) timer_->cancel();
  timer_ = create_wall_timer(period, [this] { Turn(); });
}

}  // namespace stage_ros2_cpp

RCLCPP_COMPONENTS_REGISTER_NODE(stage_ros2_cpp::StageNode)
