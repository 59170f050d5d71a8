// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/robot_messages.hh"

#include <limits>

#include "recording/cdr.hh"
#include "recording/message_parts.hh"

namespace Stg::recording {

namespace {

// ---- definitions --------------------------------------------------------------------------------

constexpr char kAccel[] =
    "geometry_msgs/Accel\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n";
constexpr char kColor[] = "std_msgs/ColorRGBA\nfloat32 r\nfloat32 g\nfloat32 b\nfloat32 a\n";
constexpr char kDuration[] = "builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n";
constexpr char kCompressedImage[] =
    "sensor_msgs/CompressedImage\nstd_msgs/Header header\nstring format\nuint8[] data\n";
constexpr char kCoordinate[] = "visualization_msgs/UVCoordinate\nfloat32 u\nfloat32 v\n";
constexpr char kMeshFile[] = "visualization_msgs/MeshFile\nstring filename\nuint8[] data\n";
constexpr char kMarker[] =
    "visualization_msgs/Marker\nstd_msgs/Header header\nstring ns\nint32 id\nint32 type\n"
    "int32 action\ngeometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\n"
    "std_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\nbool frame_locked\n"
    "geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n"
    "sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\n"
    "string text\nstring mesh_resource\nvisualization_msgs/MeshFile mesh_file\n"
    "bool mesh_use_embedded_materials\n";

// ---- markers ------------------------------------------------------------------------------------

constexpr int32_t kAdd = 0, kDeleteAll = 3, kArrow = 0;

struct MarkerPlace {
  std::string_view topic, frame;
  usec_t time;
};

/// Puts empty sequences and texts.
void PutEmpty(int count, CdrWriter* to) {
  for (int i = 0; i < count; i++) to->Put(uint32_t{0});
}

void PutMarker(const MarkerPlace& place, int32_t id, int32_t action, const Touch& touch,
               CdrWriter* to) {
  to->Align(sizeof(int32_t));
  PutHeader(place.time, place.frame, to);
  to->PutText(place.topic);
  for (const int32_t number : {id, kArrow, action}) to->Put(number);
  PutPlace(Pose(touch.x, touch.y, 0, touch.heading), to);
  const bool is_shown = action == kAdd;
  for (const double size : {0.2, 0.03, 0.03}) to->Put(is_shown ? size : 0);
  for (const float part : {is_shown ? 1.0f : 0.0f, 0.0f, 0.0f, 1.0f}) to->Put(part);
  to->Put(int32_t{0});  // lifetime: until it is deleted
  to->Put(uint32_t{0});
  to->Put(uint8_t{0});  // not locked to the frame
  PutEmpty(2, to);      // points and colors
  to->PutText("");      // texture
  PutHeader(0, "", to);
  to->PutText("");
  PutEmpty(2, to);  // data and coordinates of the texture
  to->PutText(touch.thing);
  to->PutText("");  // mesh
  to->PutText("");
  PutEmpty(1, to);
  to->Put(uint8_t{0});
}

}  // namespace

MessageType TwistType() {
  return {"geometry_msgs/msg/TwistStamped",
          WithTypes("std_msgs/Header header\ngeometry_msgs/Twist twist\n",
                    {kHeader, kTime, kTwist, kVector3})};
}

MessageType AccelerationType() {
  return {"geometry_msgs/msg/AccelStamped",
          WithTypes("std_msgs/Header header\ngeometry_msgs/Accel accel\n",
                    {kHeader, kTime, kAccel, kVector3})};
}

MessageType PoseType() {
  return {"geometry_msgs/msg/PoseStamped",
          WithTypes("std_msgs/Header header\ngeometry_msgs/Pose pose\n",
                    {kHeader, kTime, kPose, kPoint, kQuaternion})};
}

MessageType ContactsType() {
  return {"visualization_msgs/msg/MarkerArray",
          WithTypes("visualization_msgs/Marker[] markers\n",
                    {kMarker, kHeader, kTime, kPose, kPoint, kQuaternion, kVector3, kColor,
                     kDuration, kCompressedImage, kCoordinate, kMeshFile})};
}

MessageType BatteryType() {
  return {"sensor_msgs/msg/BatteryState",
          WithTypes("std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\n"
                    "float32 current\nfloat32 charge\nfloat32 capacity\nfloat32 design_capacity\n"
                    "float32 percentage\nuint8 power_supply_status\nuint8 power_supply_health\n"
                    "uint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
                    "float32[] cell_temperature\nstring location\nstring serial_number\n",
                    {kHeader, kTime})};
}

void PutTwist(const Pose& numbers, std::string_view frame, usec_t time, Buffer* message) {
  CdrWriter to(message);
  PutHeader(time, frame, &to);
  for (const double number : {numbers.x, numbers.y, numbers.z, 0.0, 0.0, numbers.a}) to.Put(number);
}

void PutPose(const Pose& pose, std::string_view frame, usec_t time, Buffer* message) {
  CdrWriter to(message);
  PutHeader(time, frame, &to);
  PutPlace(pose, &to);
}

void PutContacts(const std::vector<Touch>& touches, std::string_view topic, std::string_view frame,
                 usec_t time, Buffer* message) {
  CdrWriter to(message);
  const MarkerPlace place = {topic, frame, time};
  to.Put(static_cast<uint32_t>(touches.size() + 1));
  PutMarker(place, 0, kDeleteAll, {0, 0, 0, ""}, &to);
  for (size_t i = 0; i < touches.size(); i++)
    PutMarker(place, static_cast<int32_t>(i), kAdd, touches[i], &to);
}

void PutBattery(double share, BatteryStatus status, usec_t time, Buffer* message) {
  CdrWriter to(message);
  PutHeader(time, "", &to);
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 6; i++) to.Put(kUnknown);
  to.Put(static_cast<float>(share));
  to.Put(static_cast<uint8_t>(status));
  to.Put(uint8_t{0});  // health and technology are unknown
  to.Put(uint8_t{0});
  to.Put(uint8_t{1});  // present
  PutEmpty(2, &to);
  to.PutText("");
  to.PutText("");
}

}  // namespace Stg::recording
