// SPDX-License-Identifier: GPL-2.0-or-later
//
// How sensors are mounted and what they can see, for clients that publish it, such as the ROS node.

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "bindings.hh"
#include "model_handle.hh"

namespace Stg::python {

namespace {

using Place = std::tuple<double, double, double, double>;

Place PlaceOf(const Pose& pose) { return {pose.x, pose.y, pose.z, pose.a}; }

/// One sensor of a ranger.
struct RangeSensor {
  Place pose;
  double min_range, range, fov;
  uint32_t samples;
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
                       sensor.sample_count});
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
              "x, y, z (metres) and heading (radians) of where its rays begin, on the ranger.")
      .def_ro("min_range", &RangeSensor::min_range, "Metres, as the world file says; no effect.")
      .def_ro("range", &RangeSensor::range, "Metres: how far it sees.")
      .def_ro("fov", &RangeSensor::fov,
              "Radians, from the first sample to the last; no effect if there is one only.")
      .def_ro("samples", &RangeSensor::samples, "How many rays it has.");
}

void BindView(nb::module_& module) {
  nb::class_<View>(module, "View",
                   "What a camera or a blobfinder looks at: see Model.view. Angles are radians.")
      .def_ro("width", &View::width, "Of the picture, pixels.")
      .def_ro("height", &View::height, "Of the picture, pixels.")
      .def_ro("fov", &View::fov, "The angle that it is wide.")
      .def_ro("vertical_fov", &View::vertical_fov, "The angle that it is high.")
      .def_ro("near", &View::near, "Metres: nothing nearer is seen.")
      .def_ro("far", &View::far, "Metres: nothing farther is seen.")
      .def_ro("pan", &View::pan, "Where its middle points, to the left of the model's heading.")
      .def_ro("tilt", &View::tilt, "How far it looks down.");
}

}  // namespace

void BindSensors(nb::module_& module, nb::class_<ModelHandle>& model) {
  BindRangeSensor(module);
  BindView(module);
  model
      .def_prop_ro("interval", Getter([](Model& m) {
                     return static_cast<double>(m.GetUpdateInterval()) / 1e6;
                   }),
                   "Seconds of simulated time between its updates; 0: in each step.")
      .def_prop_ro("last_update",
                   Getter([](Model& m) { return static_cast<double>(m.GetLastUpdate()) / 1e6; }),
                   "Seconds: the time of the step in which it updated last. 0: it has not updated.")
      .def_prop_ro("pose_in_tree", Getter([](Model& m) {
                     return PoseInTree(m, &Model::GetPose, &Model::GetGlobalPose);
                   }),
                   "x, y, z (metres) and heading (radians) in the frame of the model that its tree "
                   "of models stands on the ground with, such as the robot that carries it.")
      .def_prop_ro("sensed_pose_in_tree", Getter([](Model& m) {
                     return PoseInTree(m, &Model::GetSensedLocalPose, &Model::GetSensedPose);
                   }),
                   "Where it was in that frame when its tree sensed last: see sensed_pose. It "
                   "differs from pose_in_tree while an actuator below it moves.")
      .def_prop_ro("sensors", Getter([](Model& m) { return SensorsOf(m); }),
                   "Of a ranger: its sensors, in the order of the file. TypeError if it is none.")
      .def_prop_ro("lines",
                   Getter([](Model& m) { return As<ModelBumper>(m, "bumper").bumper_count; }),
                   "Of a bumper: how many touch lines it has. TypeError if it is none.")
      .def_prop_ro("view", Getter([](Model& m) { return ViewOf(m); }),
                   "Of a camera or a blobfinder. TypeError if it is neither.");
}

}  // namespace Stg::python
