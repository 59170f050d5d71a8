// SPDX-License-Identifier: GPL-2.0-or-later
//
// Parts that several ROS 2 messages have: definitions of nested types, headers and poses.

#ifndef STAGE_RECORDING_MESSAGE_PARTS_HH
#define STAGE_RECORDING_MESSAGE_PARTS_HH

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <string_view>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"
#include "recording/cdr.hh"

namespace Stg::recording {

// ---- definitions --------------------------------------------------------------------------------

inline constexpr char kTime[] = "builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
inline constexpr char kHeader[] =
    "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
inline constexpr char kPoint[] = "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
inline constexpr char kVector3[] = "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
inline constexpr char kQuaternion[] =
    "geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
inline constexpr char kPose[] =
    "geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n";
inline constexpr char kTwist[] =
    "geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n";
inline constexpr char kPoseWithCovariance[] =
    "geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n";
inline constexpr char kTwistWithCovariance[] =
    "geometry_msgs/TwistWithCovariance\ngeometry_msgs/Twist twist\nfloat64[36] covariance\n";
inline constexpr char kTransform[] =
    "geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n";
inline constexpr char kTransformStamped[] =
    "geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform\n";
inline constexpr char kMapMetaData[] =
    "nav_msgs/MapMetaData\nbuiltin_interfaces/Time map_load_time\nfloat32 resolution\n"
    "uint32 width\nuint32 height\ngeometry_msgs/Pose origin\n";

/// Appends the definitions of nested types, each after a line of 80 equal signs.
inline std::string WithTypes(std::string definition, std::initializer_list<const char*> types) {
  for (const char* type : types) definition.append(80, '=').append("\nMSG: ").append(type);
  return definition;
}

// ---- parts of messages --------------------------------------------------------------------------

inline constexpr size_t kStampPlace = kCdrHeaderBytes;  // each message begins with its time stamp

inline void SetStamp(usec_t time, uint8_t* place) {
  const auto seconds = static_cast<int32_t>(time / 1'000'000);
  const auto nanoseconds = static_cast<uint32_t>(time % 1'000'000 * 1000);
  std::memcpy(place, &seconds, 4);
  std::memcpy(place + 4, &nanoseconds, 4);
}

inline void PutStamp(usec_t time, CdrWriter* to) {
  to->Put(static_cast<int32_t>(time / 1'000'000));
  to->Put(static_cast<uint32_t>(time % 1'000'000 * 1000));
}

inline void PutHeader(usec_t time, std::string_view frame, CdrWriter* to) {
  PutStamp(time, to);
  to->PutText(frame);
}

/// Position and orientation, serialized alike in Pose and Transform.
struct PlaceInSpace {
  explicit PlaceInSpace(const Pose& pose) {
    const SineCosine half = SinCos(pose.a / 2);
    const double all[7] = {pose.x, pose.y, pose.z, 0, 0, half.sine, half.cosine};
    std::memcpy(numbers, all, sizeof all);
  }
  double numbers[7];
};

inline void PutPlace(const Pose& pose, CdrWriter* to) {
  for (const double number : PlaceInSpace(pose).numbers) to->Put(number);
}

}  // namespace Stg::recording

#endif
