# SPDX-License-Identifier: GPL-2.0-or-later
"""The node's parameters: defaults, valid values and descriptions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Mapping

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.node import Node

from .names import BASE_FRAME, FOOTPRINT_FRAME, MAP_FRAME, ODOMETRY_FRAME, SCHEMES


@dataclass(frozen=True)
class Parameter:
    """A parameter of the node.

    Attributes:
        default: the default value, which also determines the type.
        text: the description.
        expected: the valid values in words; empty: any value of the type.
        fits: whether a value of the right type is valid.
        fixed: True: it can't be changed while the node runs.
    """

    default: Any
    text: str
    expected: str = ""
    fits: Callable[[Any], bool] = lambda _: True
    fixed: bool = False


def _one_of(*values: str) -> dict[str, Any]:
    return {"expected": " or ".join(values), "fits": lambda value: value in values, "fixed": True}


def _at_least(least: float) -> dict[str, Any]:
    return {"expected": f"a number, {least:g} or more", "fits": lambda value: value >= least}


PARAMETERS = {
    "world_file": Parameter("", "the world, if it is not on the command line", fixed=True),
    "naming": Parameter("stage_ros2", "naming scheme of topics and frames", **_one_of(*SCHEMES)),
    "enforce_prefixes": Parameter(False, "use a prefix for a single robot, too", fixed=True),
    "odom_frame_id": Parameter(ODOMETRY_FRAME, "frame of the odometry", fixed=True),
    "base_link_frame_id": Parameter(BASE_FRAME, "frame of a robot's body", fixed=True),
    "base_footprint_frame_id": Parameter(FOOTPRINT_FRAME, "frame of a robot on the floor", fixed=True),
    "map_frame_id": Parameter(MAP_FRAME, "frame of the world", fixed=True),
    "publish_tf": Parameter(True, "publish /tf and /tf_static", fixed=True),
    "publish_map_tf": Parameter(False, "publish the true transform from the map to each odometry",
                                fixed=True),
    "publish_map": Parameter(False, "publish /map and /map_metadata, which normally a map_server or SLAM does", fixed=True),
    "map_resolution": Parameter(0.05, "side of a cell of /map, metres; a node with --map has that of the file",
                                "a number, 0.0001 to 1000", lambda value: 0.0001 <= value <= 1000, fixed=True),
    "map_height": Parameter(-1.0, "/map has what a lidar at this height sees, metres; below 0: all that stands still", fixed=True),
    "namespaced_tf": Parameter("never", "publish the frames of each robot with a prefix on /PREFIX/tf and /PREFIX/tf_static, "
                               "and name them without the prefix, as Nav2 expects of several robots: never, also (beside "
                               "/tf, which has prefixes) or only", **_one_of("never", "also", "only")),
    "single_beams": Parameter("scan", "the kind of message for sensors with one ray",
                              **_one_of("scan", "range", "none")),
    "wheel_radius": Parameter(0.0, "radius of wheels, metres; 0: a fifth of their separation", **_at_least(0), fixed=True),
    "wheel_separation": Parameter(0.0, "distance of the left from the right wheels, metres; 0: the width of the body",
                                  **_at_least(0), fixed=True),
    "ticks_per_turn": Parameter(1000, "ticks that encoders count in a turn of a wheel", **_at_least(1), fixed=True),
    "imu_gyro_noise": Parameter(0.0, "standard deviation of the noise of gyroscopes, rad/s", **_at_least(0), fixed=True),
    "imu_gyro_walk": Parameter(0.0, "standard deviation of the change of their bias in a second, rad/s", **_at_least(0),
                               fixed=True),
    "imu_accelerometer_noise": Parameter(0.0, "standard deviation of the noise of accelerometers, m/s2", **_at_least(0),
                                         fixed=True),
    "imu_accelerometer_walk": Parameter(0.0, "standard deviation of the change of their bias in a second, m/s2",
                                        **_at_least(0), fixed=True),
    "sensor_qos": Parameter("reliable", "reliability of sensors' topics: reliable publishers reach subscribers "
                            "of both kinds", **_one_of("reliable", "best_effort")),
    "ranges": Parameter("rep117", "values of ranges and depths: rep117: infinity where nothing is hit, and minus infinity "
                        "for an object that is too near; stage: the maximum range, and the object's distance",
                        **_one_of("rep117", "stage")),
    "clock_rate": Parameter(0.0, "messages on /clock per second of real time; 0: one per step",
                            "a number, 0 to 1000", lambda value: 0 <= value <= 1000, fixed=True),
    "stamped_cmd_vel": Parameter(False, "messages on cmd_vel are of the type TwistStamped", fixed=True),
    "cars_turn": Parameter(False, "angular.z on cmd_vel of cars is a turn rate, whatever car_command says", fixed=True),
    "always_on": Parameter(False, "run all sensors from the beginning, even without subscribers",
                           fixed=True),
    "base_watchdog_timeout": Parameter(
        0.2, "seconds of simulated time without a command after which a robot stops; 0: never",
        **_at_least(0)),
    "speed": Parameter(1.0, "simulated seconds per second of real time; 0: as many as possible", **_at_least(0)),
    "paused": Parameter(False, "start in the paused state", fixed=True),
    "log_file": Parameter("", "an MCAP file in which the run is recorded, as by stage --log; empty: none", fixed=True),
    "gui": Parameter(False, "serve a page that shows the world, at any free port", fixed=True),
    "steps": Parameter(1, "number of steps per call of the service step", expected="a whole number, 1 to 1000000",
                       fits=lambda value: 1 <= value <= 1_000_000),
    "seed": Parameter(-1, "seed for the service reset; -1: keep the current seed", **_at_least(-1)),
    "snapshot_file": Parameter("", "file of the services snapshot and restore; empty: the state stays in memory"),
    "lockstep": Parameter("", "names of the robots and other clients that the simulation waits for, separated by "
                              "commas; \"all\": all robots"),
    "lockstep_interval": Parameter(0.0, "seconds of simulated time between two answers of a client; 0: one per step",
                                   **_at_least(0)),
}


def declare(node: Node, parameters: Mapping[str, Parameter] = PARAMETERS,
            locked: Callable[[], bool] | None = None) -> None:
    """Declares all parameters.

    Args:
        node: the node.
        parameters: the parameters by name.
        locked: whether fixed parameters can't be changed at present; None: they never can.

    Raises:
        ValueError: a given value is invalid.
    """
    for name, parameter in parameters.items():
        number = isinstance(parameter.default, (int, float, list)) and not isinstance(parameter.default, bool)
        # Types of numbers are checked here and not by rclpy, which would refuse 2 instead of 2.0.
        node.declare_parameter(name, parameter.default, ParameterDescriptor(
            description=parameter.text, read_only=parameter.fixed and locked is None, dynamic_typing=number))
        complaint = complaint_about(name, node.get_parameter(name).value, parameters)
        if complaint:
            raise ValueError(complaint)

    def check(changes: list[Any]) -> SetParametersResult:
        for change in changes:
            complaint = complaint_about(change.name, change.value, parameters)
            if locked is not None and change.name in parameters and parameters[change.name].fixed and locked():
                complaint = f"parameter {change.name}: found a world, expected the transition cleanup before the change"
            if complaint:
                return SetParametersResult(successful=False, reason=complaint)
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)


def complaint_about(name: str, value: Any, parameters: Mapping[str, Parameter] = PARAMETERS) -> str:
    """Describes why the value is invalid for the parameter; empty if it is valid."""
    known = parameters.get(name)
    if known is None:
        return ""
    if _has_type_of(known.default, value) and known.fits(value):
        return ""
    expected = known.expected or {bool: "true or false", str: "a text"}[type(known.default)]
    return f"parameter {name}: found {value!r}, expected {expected}"


def _has_type_of(default: Any, value: Any) -> bool:
    if isinstance(default, (bool, str)):
        return isinstance(value, type(default))
    if isinstance(default, list):  # rclpy has arrays, and bytes if there are no numbers
        return not isinstance(value, (str, int, float)) and all(_has_type_of(0.0, number) for number in value)
    return isinstance(value, (int, float) if isinstance(default, float) else int) and not isinstance(value, bool)


def undeclare(node: Node, name: str) -> None:
    """Removes a parameter, which may be a fixed one."""
    node._descriptors[name] = ParameterDescriptor()  # undeclare_parameter() refuses read-only parameters
    node.undeclare_parameter(name)
