// SPDX-License-Identifier: GPL-2.0-or-later
//
// The ROS 2 messages that logs consist of, and how they are put into bytes. What stays the same
// from one message to the next is put into bytes once.

#ifndef STAGE_RECORDING_ROS_MESSAGES_HH
#define STAGE_RECORDING_ROS_MESSAGES_HH

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "geometry/geometry.hh"
#include "models/ranger.hh"
#include "recording/buffer.hh"
#include "recording/odometry_covariance.hh"

namespace Stg::recording {

struct MessageType {
  const char* name;        ///< as "sensor_msgs/msg/LaserScan"
  std::string definition;  ///< with those of all types in it
};
MessageType LaserScanType();
MessageType OdometryType();
MessageType TransformsType();
MessageType ClockType();
MessageType OccupancyGridType();
/// Where the models of a world are: of our own, for replays. Each model with its parent (0: none)
/// and its pose in the parent's frame.
MessageType ModelPosesType();

inline uint64_t Nanoseconds(usec_t time) { return time * 1000; }

/// How ranges read where nothing was hit, or where something is nearer than the minimum.
enum class RangeConvention {
  kRep117,  ///< infinity, and minus infinity
  kStage,   ///< the maximum, and the distance
};

/// LaserScans of one sensor.
class ScanMaker {
 public:
  ScanMaker(std::string frame, usec_t interval, RangeConvention convention)
      : frame_(std::move(frame)), interval_(interval), convention_(convention) {}
  /// How large the next one will be.
  size_t Prepare(const ModelRanger::Sensor& sensor);
  /// Fills in that one. `time`: of the readings.
  void Write(const ModelRanger::Sensor& sensor, usec_t time, uint8_t* to) const;

 private:
  bool IsLike(const ModelRanger::Sensor& sensor) const;

  std::string frame_;
  usec_t interval_;
  RangeConvention convention_;
  Buffer head_;  // up to the ranges
  size_t count_ = 0;
  double fov_ = 0;
  Bounds range_;
};

/// Odometry messages of one robot.
class OdometryMaker {
 public:
  OdometryMaker(const std::string& frame, const std::string& child_frame);
  size_t size() const { return bytes_.size(); }
  /// `error`: what the odometry adds to its motion, as shares of it; 0 for poses that are true.
  void Write(const Pose& pose, const Velocity& velocity, const Velocity& error, usec_t time,
             uint8_t* to);

 private:
  Buffer bytes_;
  size_t pose_ = 0, twist_ = 0;  // where these begin
  OdometryCovariance covariance_;
};

struct Transform {
  const std::string* frame;
  const std::string* child_frame;
  Pose pose;
  usec_t time;
};
void PutTransforms(const std::vector<Transform>& transforms, Buffer* to);
void PutClock(usec_t time, Buffer* to);

struct ModelPose {
  uint32_t model, parent;
  Pose pose;
};
void PutModelPoses(const std::vector<ModelPose>& poses, usec_t time, Buffer* to);

/// Cells from the lower left corner, row by row: 0 free, 100 occupied.
struct OccupancyMap {
  double resolution = 0;
  uint32_t width = 0, height = 0;
  Pose origin;  // of the lower left corner
  std::vector<int8_t> cells;
};
void PutOccupancyGrid(const OccupancyMap& map, usec_t time, Buffer* to);

// Reading back; false if the message is damaged.

bool GetModelPoses(std::string_view message, std::vector<ModelPose>* poses);
/// Infinite ranges become the scan's maximum, or its minimum if they are negative, as Stage has
/// them.
bool GetScan(std::string_view message, std::vector<double>* ranges,
             std::vector<double>* intensities);

}  // namespace Stg::recording

#endif
