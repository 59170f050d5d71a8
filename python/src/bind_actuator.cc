// SPDX-License-Identifier: GPL-2.0-or-later
//
// Actuators: linear and rotational joints.

#include <nanobind/stl/tuple.h>

#include <string>
#include <tuple>

#include "array_groups.hh"
#include "bindings.hh"
#include "checked_argument.hh"
#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"
#include "model_handle.hh"
#include "text.hh"

namespace Stg::python {

namespace {

ModelActuator& AsActuator(Model& model) { return As<ModelActuator>(model, "actuator"); }

/// The state of an actuator at one time; lengths in metres, angles in radians.
struct ActuatorState {
  std::string kind;
  double position, sensed_position, velocity, min_position, max_position, max_speed;
  std::tuple<double, double, double> axis;
};

/// The displacement along the joint from the pose of the newest readings to the present one.
double SinceSensing(const ModelActuator& actuator) {
  const Pose now = actuator.GetPose(), sensed = actuator.GetSensedLocalPose();
  if (actuator.GetType() == ModelActuator::TYPE_ROTATIONAL) return normalize(now.a - sensed.a);
  const point_t moved = Rotated(point_t(now.x - sensed.x, now.y - sensed.y), SinCos(-now.a));
  const point3_t axis = actuator.GetAxis();
  return axis.x * moved.x + axis.y * moved.y + axis.z * (now.z - sensed.z);
}

ActuatorState StateOf(Model& model) {
  const ModelActuator& actuator = AsActuator(model);
  const bool turns = actuator.GetType() == ModelActuator::TYPE_ROTATIONAL;
  const point3_t axis = turns ? point3_t(0, 0, 1) : actuator.GetAxis();
  return {turns ? "rotational" : "linear",
          actuator.GetPosition(),
          actuator.GetPosition() - SinceSensing(actuator),
          actuator.GetVelocity(),
          actuator.GetMinPosition(),
          actuator.GetMaxPosition(),
          actuator.GetMaxSpeed(),
          {axis.x, axis.y, axis.z}};
}

}  // namespace

void BindActuators(nb::module_& module, nb::class_<ModelHandle>& model) {
  nb::class_<ActuatorState>(
      module, "Actuator",
      "The state of an actuator at one time. Positions are displacements from "
      "its pose in the world file: metres if linear, radians if rotational.")
      .def_ro("kind", &ActuatorState::kind, "'linear' or 'rotational'.")
      .def_ro("position", &ActuatorState::position, "Its present position.")
      .def_ro("sensed_position", &ActuatorState::sensed_position,
              "Its position when the newest readings of its tree were taken.")
      .def_ro("velocity", &ActuatorState::velocity, "Its velocity per second.")
      .def_ro("min_position", &ActuatorState::min_position, "The lower end of its range.")
      .def_ro("max_position", &ActuatorState::max_position, "The upper end of its range.")
      .def_ro("max_speed", &ActuatorState::max_speed, "The greatest velocity per second.")
      .def_ro(
          "axis", &ActuatorState::axis,
          "The direction in which it slides, or about which it turns, in its own frame: x, y, z.");
  model
      .def_prop_ro("actuator", Getter(StateOf),
                   "The state of an actuator. Raises TypeError for other models.")
      .def(
          "move_actuator",
          [](const ModelHandle& handle, const CheckedArgument<double>& position) {
            const double goal = position.Value("position", "a number");
            handle.Change([&](Model& m) {
              EnsureSubscribed(&AsActuator(m));
              AsActuator(m).GoTo(goal);
            });
          },
          nb::arg("position"),
          "Lets an actuator move to a position in its range, metres or radians.");
}

}  // namespace Stg::python
