# SPDX-License-Identifier: GPL-2.0-or-later
"""A trip of a robot through a simulated world that stands for the real one: it gets measurements with errors only."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import stagesim as st

Floats = npt.NDArray[np.float64]
Command = tuple[float, float]  #: ahead, m/s, and turning, rad/s
HERE = Path(__file__).resolve().parent
NEAR = 0.02  # m: others who are stopped this near to the robot have run into it


class Limits(NamedTuple):
    """Bounds of the robot's motors, as in the world files."""

    speed: float = 0.6  # m/s
    turn: float = 1.5  # rad/s
    acceleration: float = 1.0  # m/s^2
    turn_acceleration: float = 3.0  # rad/s^2


class Other(NamedTuple):
    """Somebody else in the world."""

    start: tuple[float, float]
    goal: tuple[float, float]
    speed: float
    kind: str  #: "go to", "social force" or "orca"


class Noise(NamedTuple):
    """Standard deviations of the errors of measurements, which are drawn anew for each."""

    place: float = 0.0  # m, of the places of the robot and of others
    heading: float = 0.0  # rad, of the robot's
    speed: float = 0.0  # m/s, of the velocities of others


class Scene(NamedTuple):
    """Where a trip leads, and who else is there."""

    file: str
    start: tuple[float, float, float]
    goal: tuple[float, float]
    others: tuple[Other, ...]
    walls: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = ()
    hole: tuple[float, float, float] | None = None  #: x, y and radius; others walk past it from the left to the right
    patience: float = 40.0  # s
    radius: float = 0.2  # m, of the robot
    other_radius: float = 0.25  # m
    tolerance: float = 0.3  # m: this near the goal is reached
    interval: float = 0.1  # s
    limits: Limits = Limits()


class Seen(NamedTuple):
    """Measurements; velocities of others are in the frame of the world."""

    pose: Floats
    velocity: Floats
    others: Floats
    velocities: Floats


class Driver(Protocol):
    """Drives the robot."""

    period: int  #: steps from one decision to the next

    def decide(self, seen: Seen) -> Command:
        """The speeds until the next decision."""


class Trip(NamedTuple):
    """How a trip has ended. `thought` is the only number that differs from run to run."""

    collided: bool
    arrived: bool
    fell: bool  #: whether somebody has come to the hole
    seconds: float  #: simulated
    decisions: int
    thought: float  #: s, that decisions took

    @property
    def result(self) -> tuple[float, ...]:
        """All that is the same in each run."""
        return self[:5]


CONTROLLERS = {"go to": "stage/behaviour kind=2", "social force": "stage/pedestrian", "orca": "stage/orca"}


def world_of(scene: Scene, seed: int) -> st.World:
    """The world of a trip: that of the file, and others."""
    text = (HERE / scene.file).read_text()
    for i, (start, goal, speed, kind) in enumerate(scene.others):
        heading = np.degrees(np.arctan2(goal[1] - start[1], goal[0] - start[0]))
        text += (f'position( name "other{i}" pose [{start[0]} {start[1]} 0 {heading}] size [0.5 0.5 1.7] round 1 drive "omni"\n'
                 '  localization "gps" mass 70 velocity_bounds [-10 10 -10 10 0 0 -573 573]\n'
                 f'  ctrl "{CONTROLLERS[kind]} x={goal[0]} y={goal[1]} speed={speed}" )\n')
    return st.World.from_text(text, str(HERE), seed=seed, threads=1)


class Trial:
    """The world of a trip, and its measurements."""

    def __init__(self, scene: Scene, noise: Noise, seed: int) -> None:
        self.scene, self.noise = scene, noise
        self.random = np.random.default_rng([seed, 1])
        self.world = world_of(scene, seed)
        self.robot = self.world.fleet("robot")
        self.others = self.world.fleet("other*") if scene.others else None
        self.robot.teleport(scene.start)
        self.before = self.places()

    def places(self) -> Floats:
        """Where others are now: shape (n, 2)."""
        return np.zeros((0, 2)) if self.others is None else self.others.pose[:, :2].copy()

    def measure(self) -> Seen:
        """Draws the errors of all measurements."""
        noise, n = self.noise, len(self.scene.others)
        pose = self.robot.pose[0] + self.random.normal(size=3) * (noise.place, noise.place, noise.heading)
        others, velocities = np.zeros((n, 3)), np.zeros((n, 3))
        now = self.places()
        others[:, :2] = now + noise.place * self.random.normal(size=(n, 2))
        velocities[:, :2] = (now - self.before) / self.scene.interval + noise.speed * self.random.normal(size=(n, 2))
        return Seen(pose, self.robot.actual_velocity[0].copy(), others, velocities)

    def step(self, command: Command) -> None:
        """Makes a step of the world."""
        self.before = self.places()
        self.robot.cmd[0] = command[0], 0, command[1]
        self.world.step()

    def collides(self) -> bool:
        """Whether the robot has touched somebody or something in the last step: the rule of ConsequenceEngine."""
        if self.robot.stalled[0]:
            return True
        if self.others is None:
            return False
        near = np.linalg.norm(self.places() - self.robot.pose[0, :2], axis=1) < (
            self.scene.radius + self.scene.other_radius + NEAR)
        return bool((near & self.others.stalled).any())

    def arrives(self) -> bool:
        """Whether the robot is at its goal, and all others are past the hole, if there is one."""
        hole = self.scene.hole
        if hole is not None and (self.places()[:, 0] < hole[0] + 2 * hole[2]).any():
            return False
        return bool(np.linalg.norm(self.robot.pose[0, :2] - self.scene.goal) < self.scene.tolerance)

    def falls(self) -> bool:
        """Whether the middle of anybody is over the hole."""
        if self.scene.hole is None:
            return False
        x, y, radius = self.scene.hole
        everybody = np.vstack([self.robot.pose[:, :2], self.places()])
        return bool((np.linalg.norm(everybody - (x, y), axis=1) < radius).any())


def travel(scene: Scene, driver: Driver, noise: Noise, seed: int) -> Trip:
    """Drives until the robot arrives, touches something, or is out of patience."""
    trial = Trial(scene, noise, seed)
    decisions, thought, command = 0, 0.0, (0.0, 0.0)
    steps = round(scene.patience / scene.interval)
    collided = arrived = fell = False
    for step in range(steps):
        if step % driver.period == 0:
            seen, begin = trial.measure(), time.process_time()
            command = driver.decide(seen)
            thought += time.process_time() - begin
            decisions += 1
        trial.step(command)
        collided, arrived, fell = trial.collides(), trial.arrives(), trial.falls()
        if collided or arrived or fell:
            break
    return Trip(collided, arrived, fell, (step + 1) * scene.interval, decisions, thought)
