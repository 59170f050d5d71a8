// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/operators.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <tuple>
#include <vector>

#include "array_groups.hh"
#include "bindings.hh"
#include "checked_argument.hh"
#include "model_handle.hh"
#include "text.hh"

namespace Stg::python {

namespace {

using Triple = std::tuple<double, double, double>;
using Quadruple = std::tuple<double, double, double, double>;

Triple InPlane(const Pose& pose) { return {pose.x, pose.y, pose.a}; }

ModelPosition& AsPosition(Model& model) { return As<ModelPosition>(model, "position"); }

constexpr const char* kPose = "three numbers: x, y (metres) and heading (radians)";
constexpr const char* kNumber = "a number";
constexpr const char* kInteger = "a whole number";
constexpr const char* kText = "a text";
constexpr const char* kTruth = "True or False";

/// A setter of the property `name`. `expected` describes the valid values in error messages.
template <typename Value, typename Set>
auto Setter(const char* name, const char* expected, Set set) {
  return [=](const ModelHandle& handle, const CheckedArgument<Value>& given) {
    const Value value = given.Value(name, expected);
    handle.Change([&](Model& model) { set(model, value); });
  };
}

/// Calls f() and turns the last error or warning that it logs into a Failure.
template <typename F>
void FailOnMessages(F f) {
  const ErrorCollector collector(true);
  f();
  if (!collector.lines.empty()) throw Failure{Kind::kStage, collector.lines.back()};
}

void AddSensor(const ModelHandle& handle, const CheckedArgument<double>& range,
               const CheckedArgument<double>& fov, const CheckedArgument<uint32_t>& samples,
               const CheckedArgument<Triple>& pose) {
  ModelRanger::Sensor sensor;
  sensor.range = Bounds(0, range.Value("range", kNumber));
  sensor.fov = fov.Value("fov", kNumber);
  sensor.sample_count = samples.Value("samples", "a whole number, 0 or more");
  const auto [x, y, a] = pose.Value("pose", kPose);
  sensor.pose = Pose(x, y, 0, a);
  handle.Change([&](Model& model) {
    As<ModelRanger>(model, "ranger").GetSensorsMutable().push_back(sensor);
  });
}

std::vector<ModelHandle> ChildrenOf(const ModelHandle& handle) {
  return handle.With([&](Model& model) {
    std::vector<ModelHandle> children;
    for (const Model* child : model.GetChildren())
      children.emplace_back(handle.simulation(), *child);
    return children;
  });
}

std::optional<ModelHandle> ParentOf(const ModelHandle& handle) {
  return handle.With([&](Model& model) -> std::optional<ModelHandle> {
    if (!model.Parent()) return std::nullopt;
    return ModelHandle(handle.simulation(), *model.Parent());
  });
}

void Delete(const ModelHandle& handle) {
  handle.Change([](Model& model) {
    if (&model == model.GetWorld()->GetGround())
      throw Failure{Kind::kStage, "the ground of a world can't be deleted"};
    delete &model;
  });
}

void BindTree(nb::class_<ModelHandle>& model) {
  model.def(nb::self == nb::self, nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__hash__", [](const ModelHandle& handle) { return handle.id(); })
      .def_prop_ro(
          "id", &ModelHandle::id,
          "The model's number. The models of the world file are numbered in the order of the file.")
      .def_prop_ro("exists", &ModelHandle::exists, "Whether the model exists now.")
      .def_prop_rw(
          "name", Getter([](Model& m) { return m.TokenStr(); }),
          Setter<std::string>(
              "name", kText,
              [](Model& m, const std::string& name) { FailOnMessages([&] { m.SetToken(name); }); }),
          "The model's full name. World.model() still finds the model by its former names.")
      .def_prop_ro("type", Getter([](Model& m) { return m.GetModelType(); }),
                   "The model's type, such as 'position'.")
      .def_prop_ro("parent", &ParentOf, "The model that this one stands on, or None.")
      .def_prop_ro("children", &ChildrenOf,
                   "The models that stand on this one, in the order of creation.")
      .def("delete", &Delete, "Deletes the model and everything that stands on it.");
}

void BindPlace(nb::class_<ModelHandle>& model) {
  model
      .def_prop_rw("pose", Getter([](Model& m) { return InPlane(m.GetPose()); }),
                   Setter<Triple>("pose", kPose,
                                  [](Model& m, const Triple& to) {
                                    FailOnMessages([&] {
                                      m.SetPose(Pose(std::get<0>(to), std::get<1>(to),
                                                     m.GetPose().z, std::get<2>(to)));
                                    });
                                  }),
                   "x, y (metres) and heading (radians), relative to the parent. Setting the pose "
                   "doesn't test for collisions.")
      .def_prop_rw("global_pose", Getter([](Model& m) { return InPlane(m.GetGlobalPose()); }),
                   Setter<Triple>("global_pose", kPose,
                                  [](Model& m, const Triple& to) {
                                    FailOnMessages([&] {
                                      m.SetGlobalPose(Pose(std::get<0>(to), std::get<1>(to),
                                                           m.GetGlobalPose().z, std::get<2>(to)));
                                    });
                                  }),
                   "x, y (metres) and heading (radians) in the frame of the world.")
      .def_prop_ro(
          "sensed_pose", Getter([](Model& m) { return InPlane(m.GetSensedPose()); }),
          "The model's pose, in the frame of the world, at the beginning of the last step in "
          "which it, or another model of its tree, updated. Sensor readings were taken at this "
          "pose, not at the pose at the end of the step.")
      .def_prop_rw("z", Getter([](Model& m) { return m.GetPose().z; }),
                   Setter<double>("z", kNumber,
                                  [](Model& m, double z) {
                                    Pose pose = m.GetPose();
                                    pose.z = z;
                                    FailOnMessages([&] { m.SetPose(pose); });
                                  }),
                   "Height above the model that this one stands on, in metres.")
      .def_prop_rw("size", Getter([](Model& m) {
                     const Size size = m.GetGeom().size;
                     return Triple(size.x, size.y, size.z);
                   }),
                   Setter<Triple>("size", "three numbers: metres along x, y and z",
                                  [](Model& m, const Triple& to) {
                                    Geom geom = m.GetGeom();
                                    geom.size =
                                        Size(std::get<0>(to), std::get<1>(to), std::get<2>(to));
                                    FailOnMessages([&] { m.SetGeom(geom); });
                                  }),
                   "Extents of the model's body along x, y and z, in metres.")
      .def_prop_ro("stalled", Getter([](Model& m) { return m.Stalled(); }),
                   "Whether an obstacle blocked the model's last attempt to move.")
      .def("has_collision", Getter([](Model& m) { return m.HasCollision(); }),
           "Whether the model's body overlaps an obstacle now.");
}

void BindLooks(nb::class_<ModelHandle>& model) {
  model
      .def_prop_rw("color", Getter([](Model& m) {
                     const Color c = m.GetColor();
                     return Quadruple(c.r, c.g, c.b, c.a);
                   }),
                   Setter<Quadruple>("color", "four numbers, 0 to 1: red, green, blue and opacity",
                                     [](Model& m, const Quadruple& c) {
                                       m.SetColor(Color(std::get<0>(c), std::get<1>(c),
                                                        std::get<2>(c), std::get<3>(c)));
                                     }),
                   "Red, green, blue and opacity, each from 0 to 1.")
      .def_prop_rw("obstacle_return", Getter([](Model& m) { return m.vis.obstacle_return; }),
                   Setter<bool>("obstacle_return", kTruth,
                                [](Model& m, bool value) { m.SetObstacleReturn(value); }),
                   "Whether robots collide with the model.")
      .def_prop_rw("ranger_return", Getter([](Model& m) { return m.vis.ranger_return; }),
                   Setter<double>("ranger_return", kNumber,
                                  [](Model& m, double value) {
                                    FailOnMessages([&] { m.SetRangerReturn(value); });
                                  }),
                   "The intensity that rangers measure for the model; if it is negative, rangers "
                   "see through the model.")
      .def_prop_rw("fiducial_return", Getter([](Model& m) { return m.vis.fiducial_return; }),
                   Setter<int>("fiducial_return", kInteger,
                               [](Model& m, int value) { m.SetFiducialReturn(value); }),
                   "The number that fiducial finders report for the model; 0: they don't find it.")
      .def_prop_rw("fiducial_key", Getter([](Model& m) { return m.vis.fiducial_key; }),
                   Setter<int>("fiducial_key", kInteger,
                               [](Model& m, int value) { m.SetFiducialKey(value); }),
                   "The key of the model: fiducial finders with another key don't find it.")
      .def_prop_rw(
          "blob_return", Getter([](Model& m) { return m.vis.blob_return; }),
          Setter<bool>("blob_return", kTruth, [](Model& m, bool value) { m.SetBlobReturn(value); }),
          "Whether blobfinders see the model.")
      .def_prop_rw("gripper_return", Getter([](Model& m) { return m.vis.gripper_return; }),
                   Setter<bool>("gripper_return", kTruth,
                                [](Model& m, bool value) { m.SetGripperReturn(value); }),
                   "Whether grippers can grip the model.")
      .def_prop_rw("speech", Getter([](Model& m) { return m.GetSayString(); }),
                   Setter<std::string>("speech", kText,
                                       [](Model& m, const std::string& text) { m.Say(text); }),
                   "The text that the window shows beside the model.");
}

const LightSource& AsLight(const Model& model) {
  if (const auto* light = dynamic_cast<const LightSource*>(&model)) return *light;
  RefuseType(model, "light, lightindicator or blinkenlight");
}

void Switch(Model& model, bool on) {
  if (!SwitchLight(model, on)) RefuseType(model, "light or lightindicator");
}

void BindLights(nb::class_<ModelHandle>& model) {
  model
      .def_prop_rw("on", Getter([](Model& m) { return AsLight(m).IsOn(); }),
                   Setter<bool>("on", kTruth, [](Model& m, bool on) { Switch(m, on); }),
                   "Whether a light is on: a light or lightindicator, which can be switched, or a "
                   "blinkenlight, which switches itself.")
      .def_prop_rw("intensity", Getter([](Model& m) { return AsLight(m).GetIntensity(); }),
                   Setter<double>("intensity", kNumber,
                                  [](Model& m, double intensity) {
                                    FailOnMessages([&] {
                                      As<ModelLight>(m, "light").SetIntensity(intensity);
                                    });
                                  }),
                   "Irradiance that a light causes at a distance of 1 m, W/m2, 0 or more; see the "
                   "readings of light sensors. That of a light can be set.");
}

void BindContacts(nb::class_<ModelHandle>& model) {
  model
      .def_prop_rw(
          "pushable", Getter([](Model& m) { return m.IsPushable(); }),
          Setter<bool>("pushable", kTruth, [](Model& m, bool value) { m.SetPushable(value); }),
          "Whether other bodies can push the model, with contacts of outlines.")
      .def_prop_rw(
          "friction", Getter([](Model& m) { return m.GetFriction(); }),
          Setter<double>("friction", kNumber,
                         [](Model& m, double f) { FailOnMessages([&] { m.SetFriction(f); }); }),
          "Coefficient of friction of the surface, 0 or more, with contacts of outlines.")
      .def_prop_rw("floor_friction", Getter([](Model& m) { return m.GetFloorFriction(); }),
                   Setter<double>(
                       "floor_friction", kNumber,
                       [](Model& m, double f) { FailOnMessages([&] { m.SetFloorFriction(f); }); }),
                   "Coefficient of friction with the floor, 0 or more. The weight times this is "
                   "the force that moves the model, or with which a robot pushes.");
}

void BindEnergy(nb::class_<ModelHandle>& model) {
  model
      .def_prop_rw(
          "mass", Getter([](Model& m) { return m.GetTotalMass() - m.GetMassOfChildren(); }),
          Setter<double>("mass", kNumber,
                         [](Model& m, double kg) { FailOnMessages([&] { m.SetMass(kg); }); }),
          "The model's own mass in kilograms, without its children. It can't be negative.")
      .def_prop_ro(
          "energy", Getter([](Model& m) -> std::optional<double> {
            const PowerPack* const pack = m.FindPowerPack();
            if (!pack) return std::nullopt;
            return pack->GetStored();
          }),
          "Joules stored in the power pack of the model or of the model that carries it; None: "
          "there is no power pack.")
      .def_prop_ro("energy_capacity", Getter([](Model& m) -> std::optional<double> {
                     const PowerPack* const pack = m.FindPowerPack();
                     if (!pack) return std::nullopt;
                     return pack->GetCapacity();
                   }),
                   "Joules that this power pack can store; None: there is no power pack.")
      .def_prop_ro("subscribers", Getter([](Model& m) { return m.GetSubscriptionCount(); }),
                   "Number of subscribers. A model without subscribers doesn't update.")
      .def(
          "subscribe",
          [](const ModelHandle& handle) { handle.Change([](Model& m) { m.Subscribe(); }); },
          "Makes the model update from now on.");
}

const char* NameOfDrive(const ModelPosition& position) {
  switch (position.GetDriveMode()) {
    case ModelPosition::DRIVE_DIFFERENTIAL:
      return "diff";
    case ModelPosition::DRIVE_OMNI:
      return "omni";
    case ModelPosition::DRIVE_CAR:
      return "car";
    case ModelPosition::DRIVE_CUSTOM:
      break;
  }
  return "custom";
}

void BindCars(nb::class_<ModelHandle>& model) {
  model
      .def_prop_ro("drive_type", Getter([](Model& m) { return NameOfDrive(AsPosition(m)); }),
                   "The drive of a position model: 'diff', 'omni', 'car' or, for one of a plug-in, "
                   "'custom'.")
      .def_prop_ro("wheelbase", Getter([](Model& m) { return AsPosition(m).GetWheelbase(); }),
                   "Distance between the axles of a car in metres.")
      .def_prop_ro("steering_angle", Getter([](Model& m) { return AsPosition(m).GetSteering(); }),
                   "Present steering angle of a car in radians, positive to the left.")
      .def_prop_ro("commands_turn", Getter([](Model& m) { return AsPosition(m).CommandsTurn(); }),
                   "Whether the third number of a car's command is a turn rate and not a steering "
                   "angle: car_command \"turn\".");
}

void BindDriving(nb::class_<ModelHandle>& model) {
  model
      .def_prop_ro(
          "velocity", Getter([](Model& m) { return InPlane(AsPosition(m).GetVelocity()); }),
          "Current velocity of a position model: forwards, to the left (m/s) and turning (rad/s).")
      .def_prop_ro(
          "odom_error", Getter([](Model& m) {
            const ModelPosition& position = AsPosition(m);
            const bool gps = position.GetLocalizationMode() == ModelPosition::LOCALIZATION_GPS;
            const Velocity error = gps ? Velocity() : position.GetOdomError();
            return Triple(error.x, error.y, error.a);
          }),
          "Odometry error of a position model: the share of each motion (forwards, to the left "
          "and turning) that the odometry adds to it. 0 with GPS.")
      .def(
          "drive",
          [](const ModelHandle& handle, const CheckedArgument<double>& x,
             const CheckedArgument<double>& y, const CheckedArgument<double>& a) {
            const Velocity to(x.Value("x", kNumber), y.Value("y", kNumber), 0,
                              a.Value("a", kNumber));
            handle.Change([&](Model& m) {
              EnsureSubscribed(&AsPosition(m));
              AsPosition(m).SetSpeed(to);
            });
          },
          nb::arg("x"), nb::arg("y") = 0.0, nb::arg("a") = 0.0,
          "Sets the speed of a position model from the next step on: forwards, to the left (m/s) "
          "and turning (rad/s).")
      .def(
          "go_to",
          [](const ModelHandle& handle, const CheckedArgument<double>& x,
             const CheckedArgument<double>& y, const CheckedArgument<double>& a) {
            const Pose to(x.Value("x", kNumber), y.Value("y", kNumber), 0, a.Value("a", kNumber));
            handle.Change([&](Model& m) {
              EnsureSubscribed(&AsPosition(m));
              AsPosition(m).GoTo(to);
            });
          },
          nb::arg("x"), nb::arg("y"), nb::arg("a") = 0.0,
          "Lets a position model drive to the pose, which is in the frame of its odometry.")
      .def("add_sensor", &AddSensor, nb::arg("range"), nb::arg("fov"), nb::arg("samples"),
           nb::arg("pose") = Triple(0, 0, 0),
           "Adds a sensor to a ranger. `range` is in metres, `fov` (the field of view) in radians; "
           "`samples` is the number of rays, and `pose` the sensor's pose on the ranger.");
}

}  // namespace

void BindModel(nb::module_& module) {
  nb::class_<ModelHandle> model(
      module, "Model",
      "A model in a world. It refers to the model by its number: using it raises GoneError once "
      "the model is deleted, and works again if World.restore() brings the model back.");
  BindTree(model);
  BindPlace(model);
  BindLooks(model);
  BindLights(model);
  BindContacts(model);
  BindEnergy(model);
  BindDriving(model);
  BindCars(model);
  BindSensors(module, model);
  BindActuators(module, model);
}

}  // namespace Stg::python
