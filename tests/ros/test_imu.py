# SPDX-License-Identifier: GPL-2.0-or-later
"""Errors of inertial measurement units, compared with closed forms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import stagesim as st
from ros_testing import Client, node_here
from sensor_msgs.msg import Imu
from stagesim.ros.covariance import EXACT
from stagesim.ros.imu import BLOCK, GRAVITY, ImuErrors, ImuNoise

ROBOT = 'interval_sim 10 position( name "a" size [0.4 0.4 0.4] update_interval 10 )'


def errors_of(steps: int, seed: int = 1, robot: int = 2, **sizes: float) -> np.ndarray:
    """Errors after each step of 0.04 s: shape (steps, 6)."""
    world: Any = SimpleNamespace(seed=seed, dt=0.04)
    noise = ImuNoise(ImuErrors(**sizes), world, robot)
    return np.array([noise.at(step) for step in range(steps)])


def test_white_noise_has_its_variance_and_no_memory() -> None:
    found = errors_of(20 * BLOCK, gyro_noise=0.02, accelerometer_noise=0.3)
    scaled = found / np.repeat([0.02, 0.3], 3)
    count = len(scaled)
    assert np.abs(scaled.mean(0)).max() < 4.5 / np.sqrt(count)
    assert np.abs(scaled.var(0) - 1).max() < 4.5 * np.sqrt(2 / count)
    assert np.abs((scaled[1:] * scaled[:-1]).mean(0)).max() < 4.5 / np.sqrt(count)
    across = np.corrcoef(scaled.T) - np.eye(6)
    assert np.abs(across).max() < 4.5 / np.sqrt(count)


def test_biases_walk_by_the_root_of_the_time() -> None:
    """The mean square of a change of the bias in a time T is walk^2 T: slope 1 in T, also across blocks."""
    found = errors_of(40 * BLOCK, gyro_walk=0.02, accelerometer_walk=0.3) / np.repeat([0.02, 0.3], 3)
    assert not found[0].any()
    squares = []
    lags = np.array([1, 8, 64, 512])
    for lag in lags:
        changes = found[lag::lag] - found[:-lag:lag]
        squares.append((changes**2).mean())
        assert squares[-1] == pytest.approx(0.04 * lag, rel=4.5 * np.sqrt(2 / changes.size))
    slope = np.polyfit(np.log(lags), np.log(squares), 1)[0]
    assert slope == pytest.approx(1, abs=0.05)


def test_errors_depend_on_seed_robot_and_step_alone() -> None:
    sizes = {"gyro_noise": 0.1, "gyro_walk": 0.1}
    world: Any = SimpleNamespace(seed=1, dt=0.04)
    noise = ImuNoise(ImuErrors(**sizes), world, 2)
    late = noise.at(3 * BLOCK + 5)
    assert np.array_equal(late, errors_of(3 * BLOCK + 6, **sizes)[-1])
    first = noise.at(7)
    assert np.array_equal(first, errors_of(8, **sizes)[-1])
    world.seed = 3
    assert np.array_equal(noise.at(7), errors_of(8, seed=3, **sizes)[-1]) and not np.array_equal(noise.at(7), first)
    assert not np.array_equal(errors_of(8, robot=3, **sizes)[-1], first)


def heard_by(client: Client, steps: int, **parameters: Any) -> list[Imu]:
    """The messages of a robot at rest."""
    with st.World.from_text(ROBOT) as world, node_here(world, **parameters) as node:
        heard = client.listen(Imu, "/imu")
        client.until(lambda: node.team.look_for_subscribers() or node.team.feeds and any(
            feed.active for feed in node.team.feeds if feed.topic == "imu"))
        for _ in range(steps):
            node.advance()
        client.until(lambda: len(heard) >= steps)
        return list(heard)


def test_messages_have_the_errors_and_their_variances(client: Client) -> None:
    sizes = {"gyro_noise": 0.02, "gyro_walk": 0.01, "accelerometer_noise": 0.3, "accelerometer_walk": 0.2}
    one, other = (heard_by(client, 5, **{f"imu_{name}": size for name, size in sizes.items()}) for _ in range(2))
    assert len(one) == len(other) and all(a == b for a, b in zip(one, other))
    last = one[-1]
    seconds = last.header.stamp.sec + last.header.stamp.nanosec / 1e9
    with st.World.from_text(ROBOT) as world:
        error = ImuNoise(ImuErrors(**sizes), world, world.model("a").id).at(round(seconds / world.dt))
    turn, force = last.angular_velocity, last.linear_acceleration
    assert (turn.x, turn.y, turn.z) == pytest.approx(tuple(error[:3])) and error.all()
    assert (force.x, force.y, force.z - GRAVITY) == pytest.approx(tuple(error[3:]))
    assert last.angular_velocity_covariance == pytest.approx((EXACT + 0.02**2 + 0.01**2 * seconds) * np.eye(3).ravel())
    assert last.linear_acceleration_covariance == pytest.approx((EXACT + 0.3**2 + 0.2**2 * seconds) * np.eye(3).ravel())
