# SPDX-License-Identifier: GPL-2.0-or-later
"""Drives, limits and odometry from Python: arrays of covariances, and batches that equal single worlds."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st

WORLD = """
interval_sim 100
define bot position( size [0.3 0.3 0.3] localization "odom" odom_error [0 0 0 0] )
bot( name "a" odom_noise [0.02 0.01 2 1] limit_acceleration 1 acceleration_bounds [-0.5 0.2 -0.5 0.2 0 0 -40 30] )
bot( name "b" pose [0 5 0 0] drive "car" steering_rate 20 steering_limit 30 odom_noise [0.05 0 0 3] )
bot( name "c" pose [0 10 0 0] drive "car" car_command "turn" )
"""


@pytest.fixture
def file(tmp_path):  # type: ignore[no-untyped-def]
    path = tmp_path / "motion.world"
    path.write_text(WORLD)
    return path


def test_covariances_are_live_symmetric_and_zero_without_noise(file) -> None:  # type: ignore[no-untyped-def]
    with st.World(file) as world:
        fleet = world.fleet()
        covariance, of_velocity = fleet.estimate_covariance, fleet.estimated_velocity_covariance
        assert covariance.shape == of_velocity.shape == (3, 3, 3) and covariance is fleet.estimate_covariance
        assert (covariance == 0).all()
        fleet.cmd[:] = [0.5, 0, 0.3]
        world.step(21)
        assert (covariance == covariance.transpose(0, 2, 1)).all() and (np.linalg.eigvalsh(covariance[:2]) > 0).all()
        assert (covariance[2] == 0).all() and (of_velocity[2] == 0).all()
        # The car "b" drove 20 steps at 0.5 m/s, and its heading varies by 3 degrees after 1 m of the rear axle's way.
        way = np.hypot(*np.diff(np.vstack([[0, 5], fleet.sensed_pose[1, :2]]), axis=0)[0])
        assert covariance[1, 2, 2] == pytest.approx(np.radians(3)**2 * way, rel=0.2)
        assert of_velocity[0, 2, 2] > 0


def test_batches_equal_single_worlds(file) -> None:  # type: ignore[no-untyped-def]
    batch = st.Batch(file, 4, threads=2)
    worlds = [st.World(file, seed=seed) for seed in range(4)]
    fleets = [world.fleet() for world in worlds]
    assert batch.estimate_covariance.shape == (4, 3, 3, 3)
    singles = [fleet.estimate_covariance for fleet in fleets]
    for command in ([0.5, 0, 0.3], [-0.4, 0, 0.5], [0.8, 0, -0.6]):
        batch.cmd[...] = command
        batch.step(7)
        for i, (world, fleet) in enumerate(zip(worlds, fleets)):
            fleet.cmd[...] = command
            world.step(7)
            assert (batch.velocity[i] == fleet.velocity).all() and (batch.estimate[i] == fleet.estimate).all()
            assert (batch.estimate_covariance[i] == singles[i]).all()
    assert batch.state_hashes() == [world.state_hash() for world in worlds]
    assert len({tuple(row) for row in batch.estimate[:, 0]}) == 4  # each seed has errors of its own


def test_a_ramp_continues_from_a_snapshot(file) -> None:  # type: ignore[no-untyped-def]
    with st.World(file) as world:
        fleet = world.fleet()
        fleet.cmd[:] = [0.8, 0, 0.5]
        world.step(3)
        snapshot = world.snapshot()
        world.step(10)
        state, velocity = world.state_hash(), fleet.velocity.copy()
        world.restore(snapshot)
        world.step(10)
        assert world.state_hash() == state and (fleet.velocity == velocity).all()
