// SPDX-License-Identifier: GPL-2.0-or-later
//
// How sensors are mounted and what they can see, for clients that publish it, such as the ROS node.

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "array_groups.hh"
#include "bindings.hh"
#include "model_handle.hh"
#include "text.hh"

namespace Stg::python {

namespace {

constexpr char kGroundSensor[] = "groundsensor";

using Place = std::tuple<double, double, double, double>;

Place PlaceOf(const Pose& pose) { return {pose.x, pose.y, pose.z, pose.a}; }

/// One sensor of a ranger.
struct RangeSensor {
  Place pose;
  double min_range, range, fov;
  uint32_t samples;
  double time_increment;
};

/// The image size and the view volume of a camera or a blobfinder.
struct View {
  uint32_t width, height;
  double fov, vertical_fov, near, far, pan, tilt;
};

std::vector<RangeSensor> SensorsOf(Model& model) {
  std::vector<RangeSensor> sensors;
  const Pose frame = model.GetGeom().pose;
  const SineCosine turn = SinCos(frame.a);
  for (const ModelRanger::Sensor& sensor : As<ModelRanger>(model, "ranger").GetSensors())
    sensors.push_back({PlaceOf(ModelRanger::OriginOf(sensor, frame, turn)), sensor.range.min,
                       sensor.Reach(), std::isfinite(sensor.fov) ? sensor.fov : 0,
                       sensor.sample_count, sensor.time_increment});
  return sensors;
}

View ViewOf(Model& model) {
  if (const auto* const camera = dynamic_cast<const ModelCamera*>(&model)) {
    const PerspectiveCamera& lens = camera->getCamera();
    return {static_cast<uint32_t>(camera->getWidth()),
            static_cast<uint32_t>(camera->getHeight()),
            dtor(lens.horizFov()),
            dtor(lens.vertFov()),
            lens.nearClip(),
            lens.farClip(),
            -dtor(camera->getPan()),
            dtor(camera->getTilt())};
  }
  const auto& finder = As<ModelBlobfinder>(model, "camera or blobfinder");
  return {finder.scan_width, finder.scan_height, finder.fov, finder.fov, 0,
          finder.range,      finder.pan,         0};
}

/// Pose in the frame of the root, composed of local poses: moving the root changes no bit of it.
/// `local` and `global` choose between present and sensed poses.
Place PoseInTree(const Model& model, Pose (Model::*local)() const, Pose (Model::*global)() const) {
  Pose pose;
  const Model* root = &model;
  for (; root->Parent(); root = root->Parent()) pose = (root->*local)() + pose;
  pose.z = (model.*global)().z - (root->*global)().z;
  return PlaceOf(pose);
}

void BindRangeSensor(nb::module_& module) {
  nb::class_<RangeSensor>(module, "RangeSensor", "One sensor of a ranger: see Model.sensors.")
      .def_ro("pose", &RangeSensor::pose,
              "x, y, z (metres) and heading (radians) of the origin of the rays, relative to the "
              "ranger.")
      .def_ro("min_range", &RangeSensor::min_range, "Minimum range in metres, from the world file.")
      .def_ro("range", &RangeSensor::range, "Maximum range in metres.")
      .def_ro(
          "fov", &RangeSensor::fov,
          "Angle in radians between the first and the last ray; without effect for a single ray.")
      .def_ro("samples", &RangeSensor::samples, "Number of rays.")
      .def_ro(
          "time_increment", &RangeSensor::time_increment,
          "Seconds from ray to ray; 0: all are cast at once. Readings belong to the time of the "
          "last ray.");
}

void BindView(nb::module_& module) {
  nb::class_<View>(
      module, "View",
      "The field of view of a camera or a blobfinder: see Model.view. Angles are in radians.")
      .def_ro("width", &View::width, "Width of the image in pixels.")
      .def_ro("height", &View::height, "Height of the image in pixels.")
      .def_ro("fov", &View::fov, "Horizontal angle of view.")
      .def_ro("vertical_fov", &View::vertical_fov, "Vertical angle of view.")
      .def_ro("near", &View::near, "Distance in metres below which nothing is seen.")
      .def_ro("far", &View::far, "Distance in metres above which nothing is seen.")
      .def_ro("pan", &View::pan,
              "Angle from the model's heading to the middle of the view, positive to the left.")
      .def_ro("tilt", &View::tilt, "Angle by which the view points down.");
}

/// The readings of all types of sensors: tuples as in stagesim.Reading.
nb::dict ReadingsOfTypes() {
  nb::dict all;
  for (const ModelType* type : SensorTypes()) {
    nb::list readings;
    for (const Reading& reading : type->readings)
      readings.append(nb::make_tuple(reading.name, NameOf(reading.element), reading.unit,
                                     reading.description, reading.is_list));
    all[nb::cast(type->name)] = readings;
  }
  return all;
}

std::optional<std::string> SensorTypeNameOf(Model& model) {
  const ModelType* const type = FindSensorType(model);
  return type ? std::optional(type->name) : std::nullopt;
}

/// New arrays with the readings of a model, by name.
nb::dict ReadingsOf(Model& model) {
  nb::dict readings;
  const ModelType* const type = FindSensorType(model);
  for (const Reading& reading : type ? type->readings : std::vector<Reading>()) {
    const ReadingShape shape = reading.shape(model);
    auto array = std::make_unique<Array>();
    array->Make({shape.lengths, shape.lengths + shape.axes}, DtypeOf(reading));
    CopyReading(reading, &model, shape, array->data());
    const nb::capsule owner(array.get(),
                            [](void* held) noexcept { delete static_cast<Array*>(held); });
    const Array& kept = *array.release();
    readings[nb::cast(reading.name)] = nb::cast(nb::ndarray<nb::numpy>(
        kept.data(), shape.axes, kept.shape().data(), owner, nullptr, kept.dtype()));
  }
  return readings;
}

}  // namespace

void BindSensors(nb::module_& module, nb::class_<ModelHandle>& model) {
  BindRangeSensor(module);
  BindView(module);
  module.def("readings", &ReadingsOfTypes,
             nb::sig("def readings() -> dict[str, list[tuple[str, str, str, str, bool]]]"));
  model
      .def_prop_ro(
          "interval",
          Getter([](Model& m) { return static_cast<double>(m.GetUpdateInterval()) / 1e6; }),
          "Seconds of simulated time between two updates of the model; 0: it updates in each step.")
      .def_prop_ro(
          "last_update",
          Getter([](Model& m) { return static_cast<double>(m.GetLastUpdate()) / 1e6; }),
          "Simulated time, in seconds, of the step in which the model last updated; 0: it has not "
          "updated yet.")
      .def_prop_ro(
          "pose_in_tree",
          Getter([](Model& m) { return PoseInTree(m, &Model::GetPose, &Model::GetGlobalPose); }),
          "x, y, z (metres) and heading (radians) in the frame of the root of the model's tree, "
          "such as the robot that carries a sensor. The root stands on the ground.")
      .def_prop_ro(
          "sensed_pose_in_tree", Getter([](Model& m) {
            return PoseInTree(m, &Model::GetSensedLocalPose, &Model::GetSensedPose);
          }),
          "The value of pose_in_tree at the last update of the tree's sensors: see sensed_pose. "
          "It differs from pose_in_tree while an actuator below the model moves.")
      .def_prop_ro(
          "sensors", Getter([](Model& m) { return SensorsOf(m); }),
          "The sensors of a ranger, in the order of the file. Raises TypeError for other models.")
      .def_prop_ro("sensor_type", Getter(SensorTypeNameOf),
                   "The type in sensor_types() whose readings the model has: its own type or one "
                   "that its type is derived from. None: the model is no sensor.")
      .def_prop_ro("readings", Getter(ReadingsOf),
                   nb::sig("def readings(self) -> dict[str, numpy.typing.NDArray[typing.Any]]"),
                   "The current readings as new arrays by name; empty if the model is no sensor. "
                   "Unlike Fleet.sensor(), this does not subscribe to the sensor.")
      .def_prop_ro("lines",
                   Getter([](Model& m) { return As<ModelBumper>(m, "bumper").bumper_count; }),
                   "The number of touch lines of a bumper. Raises TypeError for other models.")
      .def_prop_rw(
          "deposit_rate",
          Getter([](Model& m) { return As<ModelGroundSensor>(m, kGroundSensor).deposit_rate(); }),
          [](const ModelHandle& handle, double rate) {
            handle.With([&](Model& m) {
              if (!As<ModelGroundSensor>(m, kGroundSensor).SetDepositRate(rate))
                throw nb::value_error("found a rate that is not finite");
            });
          },
          "Amount per second that a ground sensor adds to its field, at its origin, in each step. "
          "Raises TypeError for other models.")
      .def_prop_ro(
          "view", Getter([](Model& m) { return ViewOf(m); }),
          "The field of view of a camera or a blobfinder. Raises TypeError for other models.");
}

}  // namespace Stg::python
