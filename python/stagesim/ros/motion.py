# SPDX-License-Identifier: GPL-2.0-or-later
"""Measurements of inertial sensors and encoders of wheels, followed from step to step.

There is no computation before the first subscriber. A step senses first and then moves; all values belong to the
beginning of the last step, like the poses and the readings with the same stamp.
"""

from __future__ import annotations

import math
from array import array
from typing import Mapping, Sequence

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Int64MultiArray, MultiArrayDimension, MultiArrayLayout

from .._core import Model
from ..fleet import Fleet
from .feeds import Bodies, BodyFeed
from .messages import MARK, Array, Template

#: Joints of wheels by drive. Those of a car's front wheels also steer.
WHEELS: Mapping[str, tuple[str, ...]] = {
    "diff": ("left_wheel", "right_wheel"),
    "car": ("rear_left_wheel", "rear_right_wheel", "front_left_wheel", "front_right_wheel")}
STEERING = ("front_left_steering", "front_right_steering")


class Wheels:
    """Sizes of the wheels of a robot.

    Attributes:
        names: names of the wheels; none: the drive has no wheels that are modelled.
        radius, separation: radius of each, and distance of the left from the right ones, metres.
        wheelbase: distance of the front wheels from the axle of the robot's pose, metres; 0: there are none.
    """

    def __init__(self, model: Model, radius: float, separation: float) -> None:
        """`radius`, `separation`: 0: the separation is the width of the body, and the radius a fifth of that."""
        self.names = WHEELS.get(model.drive_type, ())
        self.separation = separation or model.size[1]
        self.radius = radius or self.separation / 5
        self.wheelbase = model.wheelbase if model.drive_type == "car" else 0.0

    def speeds(self, ahead: float, turn: float) -> list[float]:
        """Turn rates of the wheels, rad/s, at a velocity of the robot: m/s and rad/s."""
        sides = [ahead - turn * self.separation / 2, ahead + turn * self.separation / 2]
        if self.wheelbase:  # front wheels roll in the direction in which they move
            sides += [math.copysign(math.hypot(side, turn * self.wheelbase), side) for side in sides]
        return [side / self.radius for side in sides]

    def angles(self, steering: float) -> list[float]:
        """Angles of the two front wheels of a car, whose axes meet that of the rear ones, by the steering angle."""
        side, ahead = self.wheelbase * math.sin(steering), self.wheelbase * math.cos(steering)
        half = self.separation / 2 * math.sin(steering)
        return [math.atan2(side, ahead - half), math.atan2(side, ahead + half)]


class Motion:
    """Accelerations of all robots, and the angles by which their wheels have turned.

    Args:
        fleet: the robots.
        wheels: the wheels of each.
        dt: duration of a step, seconds.

    Attributes:
        acceleration: of the bodies forwards and to the left, m/s2: shape (n, 2); NaN: not known yet.
        turned: angles of the wheels, rad, shape (n, 4): those that a robot has come first.
        speeds: their turn rates, rad/s, shape (n, 4).
        dt: duration of a step, seconds.
    """

    def __init__(self, fleet: Fleet, wheels: Sequence[Wheels], dt: float) -> None:
        self._fleet, self.wheels, self.dt = fleet, wheels, dt
        self.acceleration = np.full((len(fleet), 2), np.nan)
        self.turned, self.speeds = np.zeros((2, len(fleet), 4))
        self._before = np.zeros((len(fleet), 3))
        self._follows_bodies, self._follows_wheels = False, False

    def follow_bodies(self) -> None:
        """Computes accelerations from now on."""
        if not self._follows_bodies:
            self._follows_bodies = True
            self._before[:] = self._fleet.actual_velocity

    def follow_wheels(self) -> None:
        """Counts the turns of wheels from now on."""
        if not self._follows_wheels:
            self._follows_wheels = True
            self._read_speeds()

    def count(self) -> Array:
        """The turns of the wheels at the end of the last step, for begin()."""
        return self.turned + self.speeds * self.dt

    def begin(self, count: Array | None = None) -> None:
        """Starts anew after a reset or a restore; `count`: the value of count() at the restored time; None: zeros."""
        self.acceleration[:] = np.nan
        if self._follows_bodies:
            self._before[:] = self._fleet.actual_velocity
        self.turned[:] = 0.0 if count is None else count
        self.speeds[:] = 0.0

    def take_over(self, other: Motion, rows: Array, others: Array) -> None:
        """Continues the rows `others` of another motion in the rows `rows`."""
        if other._follows_bodies:
            self.follow_bodies()
        if other._follows_wheels:
            self.follow_wheels()
        for name in ("acceleration", "turned", "speeds", "_before"):
            getattr(self, name)[rows] = getattr(other, name)[others]

    def step(self) -> None:
        """Follows a step that has just been made."""
        if self._follows_bodies:
            self._accelerate()
        if self._follows_wheels:
            self.turned[:] = self.count()
            self._read_speeds()

    def _read_speeds(self) -> None:
        for row, wheels in enumerate(self.wheels):
            if wheels.names:
                ahead, _, turn = self._fleet.estimated_velocity[row]
                self.speeds[row, :len(wheels.names)] = wheels.speeds(ahead, turn)

    def _accelerate(self) -> None:
        """The change of the velocity in the frame of the body, plus the turn rate times the velocity."""
        now, before = self._fleet.actual_velocity, self._before
        mean = (now + before) / 2
        self.acceleration[:] = (now - before)[:, :2] / self.dt
        self.acceleration[:, 0] -= mean[:, 2] * mean[:, 1]
        self.acceleration[:, 1] += mean[:, 2] * mean[:, 0]
        before[:] = now


class JointsFeed(BodyFeed):
    """Angles and turn rates of the wheels of a robot, the angles of those that steer, and its actuators.

    Args:
        actuators: the models of the actuators by their names.
    """

    message = JointState

    def __init__(self, topic: str, robot: int, bodies: Bodies, motion: Motion, model: Model,
                 actuators: Mapping[str, Model]) -> None:
        super().__init__(topic, robot, bodies)
        self._actuators = list(actuators.values())
        self._motion, self._wheels, self._car = motion, motion.wheels[robot], model
        self._steers = self._wheels.wheelbase > 0
        names = [*self._wheels.names, *(STEERING if self._steers else ()), *actuators]
        self._count = len(names)
        message = JointState(name=[f"{name}_joint" for name in names],
                             position=array("d", [MARK] + [0.0] * (self._count - 1)),
                             velocity=array("d", [2 * MARK] + [0.0] * (self._count - 1)))
        self._template = Template(message)
        self._angles = self._template.doubles(MARK, self._count)
        self._speeds = self._template.doubles(2 * MARK, self._count)
        self._speeds[:] = 0.0

    def connect(self) -> None:
        self._motion.follow_wheels()

    def make(self, stamp: Array) -> bytes:
        count = len(self._wheels.names)
        self._template.stamp(stamp)
        self._angles[:count] = self._motion.turned[self._robot, :count]
        self._speeds[:count] = self._motion.speeds[self._robot, :count]
        if self._steers:
            self._angles[count:count + 2] = self._wheels.angles(self._car.steering_angle)
        for i, actuator in enumerate(self._actuators, self._count - len(self._actuators)):
            state = actuator.actuator
            self._angles[i], self._speeds[i] = state.sensed_position, state.velocity
        return self._template.bytes()


class TicksFeed(BodyFeed):
    """Counts of the encoders of the wheels, in the order of the joints."""

    message = Int64MultiArray

    def __init__(self, topic: str, robot: int, bodies: Bodies, motion: Motion, per_turn: int) -> None:
        super().__init__(topic, robot, bodies)
        self._motion, self._count = motion, len(motion.wheels[robot].names)
        self._per_radian = per_turn / (2 * math.pi)
        self._layout = MultiArrayLayout(dim=[MultiArrayDimension(
            label=" ".join(motion.wheels[robot].names), size=self._count, stride=self._count)])

    def connect(self) -> None:
        self._motion.follow_wheels()

    def make(self, stamp: Array) -> Int64MultiArray:
        turned = self._motion.turned[self._robot, :self._count]
        return Int64MultiArray(layout=self._layout,
                               data=array("q", np.floor(turned * self._per_radian).astype(np.int64).tobytes()))
