// SPDX-License-Identifier: GPL-2.0-or-later
//
// Serializes the ROS 2 messages of a log. Parts that do not change between messages are serialized
// once.

#ifndef STAGE_RECORDING_ROS_MESSAGES_HH
#define STAGE_RECORDING_ROS_MESSAGES_HH

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "geometry/geometry.hh"
#include "models/field.hh"
#include "models/model_type.hh"
#include "models/ranger.hh"
#include "recording/buffer.hh"
#include "recording/odometry_covariance.hh"

namespace Stg::recording {

struct MessageType {
  std::string name;        ///< such as "sensor_msgs/msg/LaserScan"
  std::string definition;  ///< including all nested types
};
MessageType LaserScanType();
MessageType OdometryType();
MessageType TransformsType();
MessageType ClockType();
MessageType OccupancyGridType();
/// A custom message for replays: each model with its parent (0: none) and its pose in the parent's
/// frame.
MessageType ModelPosesType();
/// A custom message with the values of a field.
MessageType FieldValuesType();

/// A custom message with the readings of a type of sensor, which has the type's name in CamelCase.
/// `sensor` is any model of the type.
MessageType ReadingsType(const ModelType& type, const Model& sensor);

inline uint64_t Nanoseconds(usec_t time) { return time * 1000; }

/// Values of ranges that hit nothing, and of hits nearer than the minimum.
enum class RangeConvention {
  kRep117,  ///< infinity, and minus infinity
  kStage,   ///< the maximum, and the measured distance
};

/// Makes LaserScan messages of one sensor.
class ScanMaker {
 public:
  ScanMaker(std::string frame, usec_t interval, RangeConvention convention)
      : frame_(std::move(frame)), interval_(interval), convention_(convention) {}
  /// Returns the size of the next message in bytes.
  size_t Prepare(const ModelRanger::Sensor& sensor);
  /// Writes the message. `time` is that of the readings, when the last ray was cast. The message
  /// has the time of the first one, as ROS has it.
  void Write(const ModelRanger::Sensor& sensor, usec_t time, uint8_t* to) const;

 private:
  bool IsLike(const ModelRanger::Sensor& sensor) const;

  std::string frame_;
  usec_t interval_;
  RangeConvention convention_;
  Buffer head_;  // the message up to its ranges
  size_t count_ = 0;
  double fov_ = 0, time_increment_ = 0;
  usec_t duration_ = 0;  // from the first ray to the last one
  Bounds range_;
};

/// Makes Odometry messages of one robot.
class OdometryMaker {
 public:
  OdometryMaker(const std::string& frame, const std::string& child_frame);
  size_t size() const { return bytes_.size(); }
  /// Goes on with the covariance of another one.
  void ContinueFrom(const OdometryMaker& other) { covariance_ = other.covariance_; }
  /// Errors of an estimate; all 0 for true poses.
  struct Errors {
    Velocity fractions;                   // of the motion, which odometry adds
    PoseCovariance of_pose, of_velocity;  // of random errors
  };
  void Write(const Pose& pose, const Velocity& velocity, const Errors& errors, usec_t time,
             uint8_t* to);

 private:
  Buffer bytes_;
  size_t pose_ = 0, twist_ = 0;  // offsets in bytes_
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

/// The readings of a sensor; `frame` is that of the robot.
void PutReadings(const ModelType& type, const Model& sensor, const std::string& frame, Buffer* to);

struct ModelPose {
  uint32_t model, parent;
  Pose pose;
};
void PutModelPoses(const std::vector<ModelPose>& poses, usec_t time, Buffer* to);

/// Cells row by row from the lower left corner: 0 free, 100 occupied.
struct OccupancyMap {
  double resolution = 0;
  uint32_t width = 0, height = 0;
  Pose origin;  // pose of the lower left corner
  std::vector<int8_t> cells;
};
void PutOccupancyGrid(const OccupancyMap& map, usec_t time, Buffer* to);

/// The pose of the middle of the field in the frame of the map, its cells, and all values.
void PutFieldValues(const ModelField& field, usec_t time, Buffer* to);

// Deserialization; returns false if the message is damaged.

bool GetModelPoses(std::string_view message, std::vector<ModelPose>* poses);
/// Replaces infinite ranges by Stage's values: the scan's maximum, or its minimum if negative.
bool GetScan(std::string_view message, std::vector<double>* ranges,
             std::vector<double>* intensities);

bool GetFieldValues(std::string_view message, std::vector<double>* values);

}  // namespace Stg::recording

#endif
