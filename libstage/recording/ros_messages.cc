// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/ros_messages.hh"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "recording/cdr.hh"
#include "recording/message_parts.hh"
#include "recording/ros_names.hh"

namespace Stg::recording {

namespace {

/// Writes a float sequence: the count, then converted(value) for each value.
template <typename F>
void WriteFloats(const std::vector<double>& from, size_t count, F converted, uint8_t* to) {
  const auto size = static_cast<uint32_t>(count);
  std::memcpy(to, &size, 4);
  to += 4;
  for (size_t i = 0; i < count; i++) {
    const auto value = static_cast<float>(converted(from[i]));
    std::memcpy(to + 4 * i, &value, 4);
  }
}

template <typename T>
std::vector<T> Elements(std::string_view bytes) {
  std::vector<T> elements(bytes.size() / sizeof(T));
  if (!elements.empty()) std::memcpy(elements.data(), bytes.data(), elements.size() * sizeof(T));
  return elements;
}

template <typename T>
T ElementAt(std::string_view bytes, size_t index) {
  T element;
  std::memcpy(&element, bytes.data() + index * sizeof element, sizeof element);
  return element;
}

void GetFloats(std::string_view bytes, std::vector<double>* to) {
  const std::vector<float> floats = Elements<float>(bytes);
  to->assign(floats.begin(), floats.end());
}

}  // namespace

MessageType LaserScanType() {
  return {"sensor_msgs/msg/LaserScan",
          WithTypes("std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\n"
                    "float32 angle_increment\nfloat32 time_increment\nfloat32 scan_time\n"
                    "float32 range_min\nfloat32 range_max\nfloat32[] ranges\n"
                    "float32[] intensities\n",
                    {kHeader, kTime})};
}

MessageType OdometryType() {
  return {"nav_msgs/msg/Odometry",
          WithTypes("std_msgs/Header header\nstring child_frame_id\n"
                    "geometry_msgs/PoseWithCovariance pose\n"
                    "geometry_msgs/TwistWithCovariance twist\n",
                    {kHeader, kTime, kPoseWithCovariance, kPose, kPoint, kQuaternion,
                     kTwistWithCovariance, kTwist, kVector3})};
}

MessageType TransformsType() {
  return {"tf2_msgs/msg/TFMessage",
          WithTypes("geometry_msgs/TransformStamped[] transforms\n",
                    {kTransformStamped, kHeader, kTime, kTransform, kVector3, kQuaternion})};
}

MessageType ClockType() {
  return {"rosgraph_msgs/msg/Clock", WithTypes("builtin_interfaces/Time clock\n", {kTime})};
}

MessageType OccupancyGridType() {
  return {"nav_msgs/msg/OccupancyGrid",
          WithTypes("std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data\n",
                    {kHeader, kTime, kMapMetaData, kPose, kPoint, kQuaternion})};
}

MessageType ModelPosesType() {
  return {"stage_msgs/msg/ModelPoses",
          WithTypes("std_msgs/Header header\nuint32[] models\nuint32[] parents\nfloat64[] x\n"
                    "float64[] y\nfloat64[] z\nfloat64[] a\n",
                    {kHeader, kTime})};
}

MessageType FieldValuesType() {
  return {
      "stage_msgs/msg/Field",
      WithTypes("std_msgs/Header header\n# of the middle of the field\ngeometry_msgs/Pose pose\n"
                "# metres\nfloat64 cell_width\nfloat64 cell_height\n"
                "uint32 columns\nuint32 rows\n"
                "# row by row from the south, each from the west\nfloat64[] values\n",
                {kHeader, kTime, kPose, kPoint, kQuaternion})};
}

MessageType ReadingsType(const ModelType& type, const Model& sensor) {
  std::string definition = "std_msgs/Header header\n";
  for (const Reading& reading : type.readings) {
    const size_t axes = reading.shape(sensor).axes;
    definition += "# " + reading.description + (reading.unit.empty() ? "" : " Unit: ") +
                  reading.unit + "\n" + NameOf(reading.element) + (axes > 0 ? "[] " : " ") +
                  reading.name + "\n";
    if (axes > 1) definition += "uint32[] " + reading.name + "_shape\n";
  }
  std::string name = "stage_msgs/msg/";
  bool is_first = true;  // letter of a word
  for (const char c : type.name) {
    const bool allowed = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (allowed) name += is_first ? static_cast<char>(std::toupper(c)) : c;
    is_first = !allowed;
  }
  return {name, WithTypes(definition, {kHeader, kTime})};
}

// ---- scans --------------------------------------------------------------------------------------

namespace {
size_t SamplesOf(const ModelRanger::Sensor& sensor) {
  return std::min(sensor.ranges.size(), sensor.intensities.size());
}
}  // namespace

bool ScanMaker::IsLike(const ModelRanger::Sensor& sensor) const {
  return head_.size() > 0 && count_ == SamplesOf(sensor) && fov_ == sensor.fov &&
         range_.min == sensor.range.min && range_.max == sensor.range.max &&
         time_increment_ == sensor.time_increment;
}

size_t ScanMaker::Prepare(const ModelRanger::Sensor& sensor) {
  if (!IsLike(sensor)) {
    count_ = SamplesOf(sensor);
    fov_ = sensor.fov;
    range_ = sensor.range;
    time_increment_ = sensor.time_increment;
    duration_ = static_cast<usec_t>(std::llround(std::min(sensor.Duration(), 1e9) * 1e6));
    const bool one = count_ < 2;  // a single sample looks straight ahead
    head_.Clear();
    CdrWriter to(&head_);
    PutHeader(0, frame_, &to);
    to.Put(static_cast<float>(one ? 0 : -fov_ / 2));
    to.Put(static_cast<float>(one ? 0 : fov_ / 2));
    to.Put(static_cast<float>(one ? 0 : fov_ / static_cast<double>(count_ - 1)));
    to.Put(static_cast<float>(time_increment_));
    to.Put(static_cast<float>(static_cast<double>(interval_) / 1e6));
    to.Put(static_cast<float>(range_.min));
    to.Put(static_cast<float>(range_.max));
  }
  return head_.size() + 2 * (4 + 4 * count_);
}

void ScanMaker::Write(const ModelRanger::Sensor& sensor, usec_t time, uint8_t* to) const {
  std::memcpy(to, head_.data(), head_.size());
  SetStamp(time - std::min(time, duration_), to + kStampPlace);
  to += head_.size();
  const auto same = [](double value) { return value; };
  if (convention_ == RangeConvention::kRep117) {
    const auto by_rep_117 = [this](double range) {
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      return range >= range_.max ? kInfinity : range < range_.min ? -kInfinity : range;
    };
    WriteFloats(sensor.ranges, count_, by_rep_117, to);
  } else {
    WriteFloats(sensor.ranges, count_, same, to);
  }
  WriteFloats(sensor.intensities, count_, same, to + 4 + 4 * count_);
}

bool GetScan(std::string_view message, std::vector<double>* ranges,
             std::vector<double>* intensities) {
  CdrReader from(message);
  from.Get<int32_t>();
  from.Get<uint32_t>();
  from.GetText();
  for (int i = 0; i < 5; i++) from.Get<float>();
  const double min_range = from.Get<float>(), max_range = from.Get<float>();
  GetFloats(from.GetSequence<float>(), ranges);
  for (double& range : *ranges)
    if (std::isinf(range)) range = range > 0 ? max_range : min_range;
  GetFloats(from.GetSequence<float>(), intensities);
  return from.is_good();
}

// ---- odometry and transforms --------------------------------------------------------------------

OdometryMaker::OdometryMaker(const std::string& frame, const std::string& child_frame) {
  constexpr size_t kCovariance = OdometryCovariance::kSize;
  CdrWriter to(&bytes_);
  PutHeader(0, frame, &to);
  to.PutText(child_frame);
  to.Align(sizeof(double));
  pose_ = to.size();
  to.PutDoubles(7 + kCovariance, 0);
  twist_ = to.size();
  to.PutDoubles(6 + kCovariance, 0);
}

void OdometryMaker::Write(const Pose& pose, const Velocity& velocity, const Errors& errors,
                          usec_t time, uint8_t* to) {
  const PlaceInSpace place(pose);
  const double twist[6] = {velocity.x, velocity.y, velocity.z, 0, 0, velocity.a};
  std::memcpy(to, bytes_.data(), bytes_.size());
  SetStamp(time, to + kStampPlace);
  covariance_.Move(pose);
  const OdometryCovariance::Matrix of_pose = covariance_.OfPose(errors.fractions, errors.of_pose);
  const OdometryCovariance::Matrix of_twist =
      OdometryCovariance::OfTwist(velocity, errors.fractions, errors.of_velocity);
  std::memcpy(to + pose_, place.numbers, sizeof place.numbers);
  std::memcpy(to + pose_ + sizeof place.numbers, of_pose.data(), sizeof of_pose);
  std::memcpy(to + twist_, twist, sizeof twist);
  std::memcpy(to + twist_ + sizeof twist, of_twist.data(), sizeof of_twist);
}

void PutTransforms(const std::vector<Transform>& transforms, Buffer* message) {
  CdrWriter to(message);
  to.Put(static_cast<uint32_t>(transforms.size()));
  for (const Transform& transform : transforms) {
    to.Align(sizeof(int32_t));
    PutHeader(transform.time, *transform.frame, &to);
    to.PutText(*transform.child_frame);
    PutPlace(transform.pose, &to);
  }
}

void PutClock(usec_t time, Buffer* message) {
  CdrWriter to(message);
  PutStamp(time, &to);
}

void PutOccupancyGrid(const OccupancyMap& map, usec_t time, Buffer* message) {
  CdrWriter to(message);
  PutHeader(time, kMapFrame, &to);
  PutStamp(time, &to);
  to.Put(static_cast<float>(map.resolution));
  to.Put(map.width);
  to.Put(map.height);
  PutPlace(map.origin, &to);
  to.Put(static_cast<uint32_t>(map.cells.size()));
  message->PutBytes(map.cells.data(), map.cells.size());
}

// ---- poses of models ----------------------------------------------------------------------------

void PutReadings(const ModelType& type, const Model& sensor, const std::string& frame, Buffer* to) {
  CdrWriter cdr(to);
  PutHeader(sensor.GetLastUpdate(), frame, &cdr);
  for (const Reading& reading : type.readings) {
    const ReadingShape shape = reading.shape(sensor);
    const size_t size = SizeOf(reading.element);
    uint8_t* const space =
        shape.axes > 0 ? cdr.PutSequence(shape.Count(), size) : cdr.PutSpace(size);
    CopyReading(reading, &sensor, shape, space);
    if (shape.axes < 2) continue;
    cdr.Put(static_cast<uint32_t>(shape.axes));
    for (size_t axis = 0; axis < shape.axes; axis++)
      cdr.Put(static_cast<uint32_t>(shape.lengths[axis]));
  }
}

void PutModelPoses(const std::vector<ModelPose>& poses, usec_t time, Buffer* message) {
  CdrWriter to(message);
  PutHeader(time, kMapFrame, &to);
  const auto count = static_cast<uint32_t>(poses.size());
  const auto put_all = [&](const auto& value_of) {
    to.Put(count);
    for (const ModelPose& pose : poses) to.Put(value_of(pose));
  };
  put_all([](const ModelPose& p) { return p.model; });
  put_all([](const ModelPose& p) { return p.parent; });
  put_all([](const ModelPose& p) { return p.pose.x; });
  put_all([](const ModelPose& p) { return p.pose.y; });
  put_all([](const ModelPose& p) { return p.pose.z; });
  put_all([](const ModelPose& p) { return p.pose.a; });
}

bool GetModelPoses(std::string_view message, std::vector<ModelPose>* poses) {
  CdrReader from(message);
  from.Get<int32_t>();
  from.Get<uint32_t>();
  from.GetText();
  // There may be millions of elements, so they are read in place.
  const std::string_view models = from.GetSequence<uint32_t>();
  const std::string_view parents = from.GetSequence<uint32_t>();
  std::string_view numbers[4];
  for (std::string_view& list : numbers) list = from.GetSequence<double>();
  const size_t count = models.size() / sizeof(uint32_t);
  bool good = from.is_good() && parents.size() == models.size();
  for (const std::string_view list : numbers) good = good && list.size() / sizeof(double) == count;
  if (!good) return false;
  const auto number = [&](size_t which, size_t i) { return ElementAt<double>(numbers[which], i); };
  poses->clear();
  poses->reserve(count);
  for (size_t i = 0; i < count; i++)
    poses->push_back({ElementAt<uint32_t>(models, i), ElementAt<uint32_t>(parents, i),
                      Pose(number(0, i), number(1, i), number(2, i), number(3, i))});
  return true;
}

// ---- fields -------------------------------------------------------------------------------------

void PutFieldValues(const ModelField& field, usec_t time, Buffer* message) {
  const std::vector<double>& values = field.values();
  CdrWriter to(message);
  PutHeader(time, kMapFrame, &to);
  PutPlace(field.GetGlobalPose() + field.GetGeom().pose, &to);
  to.Put(field.CellWidth());
  to.Put(field.CellHeight());
  to.Put(static_cast<uint32_t>(field.columns()));
  to.Put(static_cast<uint32_t>(field.rows()));
  std::memcpy(to.PutSequence(values.size(), sizeof(double)), values.data(),
              values.size() * sizeof(double));
}

bool GetFieldValues(std::string_view message, std::vector<double>* values) {
  CdrReader from(message);
  from.Get<int32_t>();
  from.Get<uint32_t>();
  from.GetText();
  for (int i = 0; i < 9; i++) from.Get<double>();  // the pose, and the size of a cell
  const auto columns = from.Get<uint32_t>(), rows = from.Get<uint32_t>();
  const std::string_view bytes = from.GetSequence<double>();
  if (!from.is_good() || bytes.size() / sizeof(double) != size_t{columns} * rows) return false;
  *values = Elements<double>(bytes);
  return true;
}

}  // namespace Stg::recording
