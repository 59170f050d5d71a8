// SPDX-License-Identifier: GPL-2.0-or-later

#include "topics.hh"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace stage_ros2_cpp {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Converts a reading to REP 117: infinity from `max` on, minus infinity below `min`.
template <class T>
T ByRep117(T reading, T min, T max) {
  if (reading >= max) return static_cast<T>(kInfinity);
  return reading < min ? -static_cast<T>(kInfinity) : reading;
}

template <class Pose>
void SetPose(const Transform& transform, Pose* pose) {
  pose->position.x = transform.x;
  pose->position.y = transform.y;
  pose->position.z = transform.z;
  pose->orientation.x = transform.qx;
  pose->orientation.y = transform.qy;
  pose->orientation.z = transform.qz;
  pose->orientation.w = transform.qw;
}

/// Sets the diagonal of a 3 x 3 matrix to the variance of exact values.
template <class Matrix>
void SetExact(Matrix* matrix) {
  for (const size_t i : {0, 4, 8}) (*matrix)[i] = kExact;
}

bool IsBigEndian() {
  const uint16_t one = 1;
  unsigned char first;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

}  // namespace

Stamp StampOf(int64_t microseconds) {
  Stamp stamp;
  stamp.sec = static_cast<int32_t>(microseconds / 1000000);
  stamp.nanosec = static_cast<uint32_t>(microseconds % 1000000 * 1000);
  return stamp;
}

// ---- bodies -------------------------------------------------------------------------------------

OdometryTopic::OdometryTopic(const Sources& sources, size_t robot, std::string name, bool is_true,
                             const std::string& frame, const std::string& child)
    : BodyTopic(sources, robot, std::move(name)), is_true_(is_true) {
  message_.header.frame_id = frame;
  message_.child_frame_id = child;
  message_.pose.covariance = message_.twist.covariance = InSpace({});
}

bool OdometryTopic::Fill(const Stamp& stamp) {
  const Bodies& bodies = from_.bodies;
  message_.header.stamp = stamp;
  SetPose(Planar(is_true_ ? bodies.Truth(robot_) : bodies.Estimate(robot_)), &message_.pose.pose);
  const Stg::Velocity velocity =
      is_true_ ? bodies.ActualVelocity(robot_) : bodies.EstimatedVelocity(robot_);
  message_.twist.twist.linear.x = velocity.x;
  message_.twist.twist.linear.y = velocity.y;
  message_.twist.twist.angular.z = velocity.a;
  if (is_true_) return true;
  message_.pose.covariance = bodies.OfPose(robot_);
  message_.twist.covariance = bodies.OfTwist(robot_);
  return true;
}

bool StallTopic::Fill(const Stamp&) {
  message_.data = from_.simulation.Robot(robot_)->Stalled();
  return true;
}

ImuTopic::ImuTopic(const Sources& sources, size_t robot, std::string name, const std::string& frame)
    : BodyTopic(sources, robot, std::move(name)) {
  message_.header.frame_id = frame;
  message_.linear_acceleration.z = kGravity;
  SetExact(&message_.orientation_covariance);
  SetExact(&message_.angular_velocity_covariance);
  SetExact(&message_.linear_acceleration_covariance);
}

bool ImuTopic::Fill(const Stamp& stamp) {
  const Motion::State& state = from_.motion.state(robot_);
  if (!state.accelerated) return false;
  const Transform truth = Planar(from_.bodies.Truth(robot_));
  message_.header.stamp = stamp;
  message_.orientation.x = truth.qx;
  message_.orientation.y = truth.qy;
  message_.orientation.z = truth.qz;
  message_.orientation.w = truth.qw;
  message_.angular_velocity.z = from_.bodies.ActualVelocity(robot_).a;
  message_.linear_acceleration.x = state.ahead;
  message_.linear_acceleration.y = state.left;
  return true;
}

JointsTopic::JointsTopic(const Sources& sources, size_t robot, std::string name)
    : BodyTopic(sources, robot, std::move(name)) {
  const Wheels& wheels = from_.motion.wheels(robot_);
  for (const std::string& wheel : wheels.names()) message_.name.push_back(wheel + "_joint");
  for (const std::string& steering : wheels.steering())
    message_.name.push_back(steering + "_joint");
  message_.position.resize(message_.name.size());
  message_.velocity.resize(message_.name.size());
}

bool JointsTopic::Fill(const Stamp& stamp) {
  const Wheels& wheels = from_.motion.wheels(robot_);
  const Motion::State& state = from_.motion.state(robot_);
  const auto count = static_cast<ptrdiff_t>(wheels.names().size());
  message_.header.stamp = stamp;
  std::copy_n(state.turned.begin(), count, message_.position.begin());
  std::copy_n(state.speeds.begin(), count, message_.velocity.begin());
  if (wheels.steering().empty()) return true;
  const auto angles = wheels.Angles(from_.simulation.Robot(robot_)->GetSteering());
  std::copy(angles.begin(), angles.end(), message_.position.begin() + count);
  return true;
}

TicksTopic::TicksTopic(const Sources& sources, size_t robot, std::string name, int64_t per_turn)
    : BodyTopic(sources, robot, std::move(name)),
      per_radian_(static_cast<double>(per_turn) / (2 * M_PI)) {
  const std::vector<std::string>& names = from_.motion.wheels(robot_).names();
  message_.layout.dim.resize(1);
  auto& dimension = message_.layout.dim[0];
  for (const std::string& wheel : names)
    dimension.label += (dimension.label.empty() ? "" : " ") + wheel;
  dimension.size = dimension.stride = static_cast<uint32_t>(names.size());
  message_.data.resize(names.size());
}

bool TicksTopic::Fill(const Stamp&) {
  for (size_t i = 0; i < message_.data.size(); i++)
    message_.data[i] =
        static_cast<int64_t>(std::floor(from_.motion.state(robot_).turned[i] * per_radian_));
  return true;
}

// ---- battery ------------------------------------------------------------------------------------

BatteryTopic::BatteryTopic(const Sources& sources, size_t robot, std::string name, double capacity)
    : TopicOf(sources, robot, std::move(name)), capacity_(capacity), before_(kNaN) {
  const auto nan = static_cast<float>(kNaN);
  message_.voltage = message_.temperature = message_.current = nan;
  message_.charge = message_.capacity = message_.design_capacity = nan;
  message_.present = true;
}

bool BatteryTopic::Fill(const Stamp& stamp) {
  const Stg::PowerPack* const pack = from_.simulation.Robot(robot_)->FindPowerPack();
  if (!pack) return false;
  const double stored = pack->GetStored();
  // Stage represents an infinite supply by a negative amount; it is always full.
  const bool infinite = stored < 0 || !std::isfinite(stored);
  message_.header.stamp = stamp;
  message_.percentage = infinite        ? 1.0f
                        : capacity_ > 0 ? static_cast<float>(stored / capacity_)
                                        : 0.0f;
  message_.power_supply_status = StatusOf(stored, infinite);
  before_ = stored;
  return true;
}

/// The status, by the change since the message before.
uint8_t BatteryTopic::StatusOf(double stored, bool infinite) const {
  if (infinite || stored >= capacity_) return Message::POWER_SUPPLY_STATUS_FULL;
  if (stored > before_) return Message::POWER_SUPPLY_STATUS_CHARGING;
  if (stored < before_) return Message::POWER_SUPPLY_STATUS_DISCHARGING;
  return Message::POWER_SUPPLY_STATUS_NOT_CHARGING;
}

// ---- rangers ------------------------------------------------------------------------------------

template <class M>
BeamsTopic<M>::BeamsTopic(const Sources& sources, size_t robot, const Sensor& sensor,
                          bool by_rep117)
    : SensorTopic<M>(sources, robot, sensor.topic, sensor),
      by_rep117_(by_rep117),
      duration_(sensor.scanner.samples > 0
                    ? std::llround(1e6 * sensor.scanner.time_increment *
                                   static_cast<double>(sensor.scanner.samples - 1))
                    : 0) {
  this->message_.header.frame_id = sensor.frame;
}

template <class M>
int64_t BeamsTopic<M>::When(int64_t now, int64_t step) const {
  return std::max<int64_t>(0, SensorTopic<M>::When(now, step) - duration_);
}

template <class M>
const Stg::ModelRanger::Sensor* BeamsTopic<M>::Measured() const {
  const Scanner& scanner = this->sensor_.scanner;
  const auto* const ranger = dynamic_cast<const Stg::ModelRanger*>(this->Model());
  if (!ranger || scanner.sensor >= ranger->GetSensors().size()) return nullptr;
  const Stg::ModelRanger::Sensor& sensor = ranger->GetSensors()[scanner.sensor];
  return sensor.ranges.size() < scanner.samples || sensor.intensities.size() < scanner.samples
             ? nullptr
             : &sensor;
}

template <class M>
float BeamsTopic<M>::Published(double range) const {
  const Scanner& scanner = this->sensor_.scanner;
  return static_cast<float>(by_rep117_ ? ByRep117(range, scanner.min_range, scanner.max_range)
                                       : range);
}

ScanTopic::ScanTopic(const Sources& sources, size_t robot, const Sensor& sensor, bool by_rep117)
    : BeamsTopic(sources, robot, sensor, by_rep117) {
  const Scanner& scanner = sensor.scanner;
  const double half = scanner.samples > 1 ? scanner.fov / 2 : 0;
  const double gaps = scanner.samples > 1 ? static_cast<double>(scanner.samples - 1) : 1;
  message_.angle_min = static_cast<float>(-half);
  message_.angle_max = static_cast<float>(half);
  message_.angle_increment = static_cast<float>(2 * half / gaps);
  message_.time_increment = static_cast<float>(scanner.time_increment);
  message_.scan_time = static_cast<float>(static_cast<double>(sensor.interval) / 1e6);
  message_.range_min = static_cast<float>(scanner.min_range);
  message_.range_max = static_cast<float>(scanner.max_range);
  message_.ranges.resize(scanner.samples);
  message_.intensities.resize(scanner.samples);
}

bool ScanTopic::Fill(const Stamp& stamp) {
  const Stg::ModelRanger::Sensor* const sensor = Measured();
  if (!sensor) return false;
  message_.header.stamp = stamp;
  for (size_t ray = 0; ray < sensor_.scanner.samples; ray++) {
    message_.ranges[ray] = Published(sensor->ranges[ray]);
    message_.intensities[ray] = static_cast<float>(sensor->intensities[ray]);
  }
  return true;
}

RangeTopic::RangeTopic(const Sources& sources, size_t robot, const Sensor& sensor, bool by_rep117)
    : BeamsTopic(sources, robot, sensor, by_rep117) {
  message_.radiation_type = Message::ULTRASOUND;
  message_.field_of_view = static_cast<float>(sensor.scanner.fov);
  message_.min_range = static_cast<float>(sensor.scanner.min_range);
  message_.max_range = static_cast<float>(sensor.scanner.max_range);
}

bool RangeTopic::Fill(const Stamp& stamp) {
  const Stg::ModelRanger::Sensor* const sensor = Measured();
  if (!sensor) return false;
  message_.header.stamp = stamp;
  message_.range = Published(sensor->ranges[0]);
  return true;
}

// ---- cameras ------------------------------------------------------------------------------------

ImageTopic::ImageTopic(const Sources& sources, size_t robot, std::string name, const Sensor& sensor,
                       bool is_depth, bool by_rep117)
    : SensorTopic(sources, robot, std::move(name), sensor),
      is_depth_(is_depth),
      by_rep117_(by_rep117) {
  message_.header.frame_id = sensor.frame;
  message_.height = sensor.view.height;
  message_.width = sensor.view.width;
  message_.encoding = is_depth ? "32FC1" : "rgb8";
  message_.is_bigendian = IsBigEndian();
  message_.step = sensor.view.width * (is_depth ? 4 : 3);
  message_.data.resize(size_t{message_.step} * message_.height);
}

bool ImageTopic::Fill(const Stamp& stamp) {
  const auto* const camera = dynamic_cast<const Stg::ModelCamera*>(Model());
  if (!camera) return false;
  if (camera->GetLastUpdate() == 0 || !camera->FrameDepth() || !camera->FrameColor()) return false;
  message_.header.stamp = stamp;
  if (is_depth_)
    FillDepths(camera->FrameDepth());
  else
    FillColors(camera->FrameColor());
  return true;
}

/// Copies red, green and blue of each pixel. The first row of a message is the top one.
void ImageTopic::FillColors(const GLubyte* colors) {
  auto to = message_.data.begin();
  for (uint32_t row = message_.height; row-- > 0;)
    for (uint32_t column = 0; column < message_.width; column++)
      to = std::copy_n(colors + 4 * (size_t{row} * message_.width + column), 3, to);
}

void ImageTopic::FillDepths(const GLfloat* depths) {
  const auto near = static_cast<float>(sensor_.view.near);
  const auto far = static_cast<float>(sensor_.view.far);
  uint8_t* to = message_.data.data();
  for (uint32_t row = message_.height; row-- > 0;)
    for (uint32_t column = 0; column < message_.width; column++, to += sizeof(float)) {
      const float depth = depths[size_t{row} * message_.width + column];
      const float published = by_rep117_ ? ByRep117(depth, near, far) : depth;
      std::memcpy(to, &published, sizeof published);
    }
}

CameraInfoTopic::CameraInfoTopic(const Sources& sources, size_t robot, std::string name,
                                 const Sensor& sensor)
    : SensorTopic(sources, robot, std::move(name), sensor) {
  const View& view = sensor.view;
  const double x = view.width / 2.0, y = view.height / 2.0;
  const double fx = x / std::tan(view.fov / 2), fy = y / std::tan(view.vertical_fov / 2);
  message_.header.frame_id = sensor.frame;
  message_.height = view.height;
  message_.width = view.width;
  message_.distortion_model = "plumb_bob";
  message_.d.assign(5, 0.0);
  message_.k = {fx, 0, x, 0, fy, y, 0, 0, 1};
  message_.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  message_.p = {fx, 0, x, 0, 0, fy, y, 0, 0, 0, 1, 0};
}

bool CameraInfoTopic::Fill(const Stamp& stamp) {
  message_.header.stamp = stamp;
  return true;
}

}  // namespace stage_ros2_cpp
