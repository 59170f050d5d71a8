# SPDX-License-Identifier: GPL-2.0-or-later
"""Inertial measurement units of robots: exact, or with white noise and biases that walk slowly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sensor_msgs.msg import Imu

from ..world import World
from .covariance import EXACT
from .feeds import Bodies, BodyFeed
from .messages import MARK, Array, Template
from .motion import Motion

GRAVITY = 9.80665  #: m/s2, which accelerometers at rest measure upwards (REP 145)
BLOCK = 1024  #: steps whose random numbers are drawn at once


@dataclass(frozen=True)
class ImuErrors:
    """Standard deviations of the errors of an inertial measurement unit, each the same for its three axes.

    Attributes:
        gyro_noise, accelerometer_noise: of the white noise of each measurement, rad/s and m/s2.
        gyro_walk, accelerometer_walk: of the change of the bias in a second, rad/s and m/s2; it grows with the square
            root of the time.
    """

    gyro_noise: float = 0.0
    gyro_walk: float = 0.0
    accelerometer_noise: float = 0.0
    accelerometer_walk: float = 0.0

    @property
    def noise(self) -> Array:
        """Standard deviations of the white noise: three axes of the gyroscope, then three of the accelerometer."""
        return np.repeat([self.gyro_noise, self.accelerometer_noise], 3)

    @property
    def walk(self) -> Array:
        """Standard deviations of the change of the bias in a second, for the same axes."""
        return np.repeat([self.gyro_walk, self.accelerometer_walk], 3)

    def variances(self, seconds: float) -> Array:
        """Variances of the errors at a time of the world, for the same axes."""
        return self.noise**2 + self.walk**2 * seconds


class ImuNoise:
    """The errors of one unit as a function of the step.

    They depend on the seed of the world, the number of the robot and the step alone, so that they are the same after a
    reset with the same seed or a restore, and for clients that subscribe late. Biases begin with 0.

    Args:
        errors: the sizes of the errors.
        world: the world.
        robot: the id of the robot.

    Attributes:
        errors: the sizes of the errors.
    """

    def __init__(self, errors: ImuErrors, world: World, robot: int) -> None:
        self.errors, self._world, self._robot = errors, world, robot
        self._seed = -1
        self._number = -1  # of the present block
        self._white = self._bias = np.zeros((BLOCK, 6))
        self._starts: list[Array] = []  # biases at the beginnings of blocks

    def at(self, step: int) -> Array:
        """Errors of the gyroscope and the accelerometer, rad/s and m/s2, after a number of steps: shape (6,)."""
        if self._seed != self._world.seed:
            self._seed, self._number, self._starts = self._world.seed, -1, [np.zeros(6)]
        number, place = divmod(step, BLOCK)
        if number != self._number:
            self._load(number)
        return self._white[place] + self._bias[place]

    def _load(self, number: int) -> None:
        while len(self._starts) <= number + 1:
            self._starts.append(self._starts[-1] + self._draw(1, len(self._starts) - 1).sum(0))
        self._number = number
        self._white = self._draw(0, number) * self.errors.noise
        steps = self._draw(1, number)
        self._bias = (self._starts[number] + np.cumsum(steps, 0) - steps[0]) * self.errors.walk * np.sqrt(self._world.dt)

    def _draw(self, purpose: int, number: int) -> Array:
        """Normal random numbers of a block; `purpose`: 0: white noise, 1: steps of the biases."""
        return np.random.default_rng([self._seed, self._robot, purpose, number]).standard_normal((BLOCK, 6))


class ImuFeed(BodyFeed):
    """An inertial measurement unit at the origin of the robot, with gravity, as REP 145 wants it.

    Without `noise`, it is exact.
    """

    message = Imu

    def __init__(self, topic: str, robot: int, bodies: Bodies, motion: Motion, frame: str,
                 noise: ImuNoise | None) -> None:
        super().__init__(topic, robot, bodies)
        self._motion, self._noise = motion, noise
        message = Imu()
        message.header.frame_id = frame
        message.orientation.x = MARK
        self._template = Template(message)
        # Orientation, turn rates and accelerations, each before its covariance.
        numbers = self._template.doubles(MARK, 37)
        numbers[:] = 0.0
        self._orientation, self._turn, self._acceleration = numbers[:4], numbers[13:16], numbers[25:28]
        self._turn_variances, self._acceleration_variances = numbers[16:25:4], numbers[28:37:4]
        for first in (4, 16, 28):
            numbers[first:first + 9:4] = EXACT

    def connect(self) -> None:
        self._motion.follow_bodies()

    def make(self, stamp: Array) -> bytes | None:
        acceleration = self._motion.acceleration[self._robot]
        if np.isnan(acceleration).any():
            return None
        self._template.stamp(stamp)
        self._orientation[:] = self._bodies.truth()[self._robot, 3:]
        self._turn[:] = 0.0, 0.0, self._bodies.velocity()[self._robot, 2]
        self._acceleration[:] = *acceleration, GRAVITY
        if self._noise is not None:
            self._add_errors(self._noise)
        return self._template.bytes()

    def _add_errors(self, noise: ImuNoise) -> None:
        seconds = float(self._bodies.times()[self._robot]) / 1e6
        errors = noise.at(round(seconds / self._motion.dt))
        self._turn += errors[:3]
        self._acceleration += errors[3:]
        variances = EXACT + noise.errors.variances(seconds)
        self._turn_variances[:], self._acceleration_variances[:] = variances[:3], variances[3:]
