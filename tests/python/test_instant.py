# SPDX-License-Identifier: GPL-2.0-or-later
"""Readings, estimates and true poses with the same time belong to one instant, so a mapper finds the walls."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import stagesim as st
from stagesim.live.scene import unpacked_scans

# A square room, whose walls have inner faces at x, y = +-5 m.
ROOM = """
ray_model "exact"
model( pose [0 5.5 0 0] size [12 1 10] )
model( pose [0 -5.5 0 0] size [12 1 10] )
model( pose [5.5 0 0 0] size [1 12 10] )
model( pose [-5.5 0 0 0] size [1 12 10] )
"""
START = np.array([1, -2, np.radians(30)])


def text_of(step: int, localization: str, ranger: int = 100, robot: int = 100) -> str:
    return f"""interval_sim {step}
{ROOM}
position( name "r" size [0.4 0.4 0.4] pose [1 -2 0 30] localization "{localization}" odom_error [0 0 0 0] update_interval {robot}
  ranger( pose [0.05 0.02 0 5] update_interval {ranger}
    sensor( pose [0.05 0 0 10] range [0 20] fov 350 samples 36 ) ) )"""


def placed(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Transforms the poses `inner` from the frames `outer` to the world frame."""
    c, s = np.cos(outer[..., 2]), np.sin(outer[..., 2])
    x, y = inner[..., 0], inner[..., 1]
    return np.stack([outer[..., 0] + c * x - s * y, outer[..., 1] + s * x + c * y,
                     outer[..., 2] + inner[..., 2]], -1)


def errors(poses: np.ndarray, scan: st.Ranger) -> np.ndarray:
    """Distances of the scans' end points from the walls, for robots at these poses."""
    ends = scan.origins + scan.ranges[..., None] * np.stack([np.cos(scan.bearings), np.sin(scan.bearings)], -1)
    ends = placed(poses[..., None, :], np.concatenate([ends, np.zeros_like(ends[..., :1])], -1))
    return np.abs(np.abs(ends[..., :2]).max(-1) - 5)


def believed(fleet: st.Fleet | st.Batch, localization: str) -> np.ndarray:
    return fleet.estimate if localization == "gps" else placed(START, fleet.estimate)


def told(what: str, found: list[np.ndarray]) -> float:
    """Prints a row of the table and returns the maximum error."""
    all_of = np.concatenate([each.ravel() for each in found]) * 1e3
    print(f"{what:60} {all_of.size:7} points, mm: median {np.median(all_of):8.3f}, "
          f"90 % {np.quantile(all_of, .9):8.3f}, max {all_of.max():8.3f}")
    return float(all_of.max() / 1e3)


@pytest.mark.parametrize("localization", ("gps", "odom"))
@pytest.mark.parametrize("step", (5, 20, 100))
def test_arrays_fit_together_after_every_step(step: int, localization: str) -> None:
    """With equal intervals of robots and rangers, arrays are consistent after every step."""
    with st.World.from_text(text_of(step, localization)) as world:
        fleet = world.fleet()
        scan = fleet.ranger()
        fleet.cmd[:] = [0.5, 0, 1.2]
        found, true = [], []
        for _ in range(6000 // step):
            world.step()
            if np.isfinite(scan.ranges).all():
                found.append(errors(believed(fleet, localization), scan))
                true.append(errors(fleet.sensed_pose, scan))
                assert fleet.sensed_time[0] == scan.time[0] <= world.time
        assert told(f"arrays, {localization}, steps of {step} ms", found) < 1e-9
        assert told("the same, true poses", true) < 1e-9
        assert len(found) > 50


@pytest.mark.parametrize("localization", ("gps", "odom"))
def test_arrays_fit_together_whatever_the_intervals(localization: str) -> None:
    for step, ranger, robot, late in itertools.product((5, 20, 100), (20, 30, 250), (40, 100), (0, 3)):
        with st.World.from_text(text_of(step, localization, ranger, robot)) as world:
            fleet = world.fleet()
            fleet.cmd[:] = [0.5, 0, 1.2]
            world.step(late)
            scan = fleet.ranger()
            found = []
            for _ in range(3000 // step):
                world.step()
                if scan.time[0] == world.time:
                    assert fleet.sensed_time[0] == world.time
                    found.append(errors(believed(fleet, localization), scan))
            assert len(found) >= 3000 // max(step, ranger) - 1
            assert told(f"{localization}, steps of {step} ms, updates {ranger} and {robot} ms", found) < 1e-9


def test_batches_fit_together() -> None:
    batch = st.Batch.of(st.World.from_text(text_of(20, "odom")), n=3)
    batch.cmd[..., 0] = 0.5
    batch.cmd[..., 2] = np.array([1.2, -0.7, 0.1])[:, None]
    scan = batch.ranger()
    for _ in range(40):
        batch.step(n=3)
        if np.isfinite(scan.ranges).all():
            assert errors(believed(batch, "odom"), scan).max() < 1e-9
            assert errors(batch.sensed_pose, scan).max() < 1e-9
    record = batch.rollout(moments=5, n=5, record=("sensed_pose", "estimate", "ranges"))
    assert record["sensed_pose"].shape == (5, 3, 1, 3) and record["estimate"].shape == (5, 3, 1, 3)


def test_the_first_step_has_no_jump() -> None:
    for localization in ("gps", "odom"):
        with st.World.from_text(text_of(100, localization)) as world:
            fleet = world.fleet()
            fleet.cmd[:] = [0.5, 0, 1.2]
            first = fleet.estimate.copy()
            assert first[0] == pytest.approx(START if localization == "gps" else np.zeros(3), abs=1e-12)
            world.step()
            assert fleet.estimate == pytest.approx(first, abs=1e-12)
            assert fleet.sensed_pose[0] == pytest.approx(START) and fleet.pose[0] != pytest.approx(START)


def test_a_blocked_robot_does_not_move() -> None:
    text = text_of(100, "odom").replace("pose [1 -2 0 30]", "pose [4.6 0 0 0]")
    with st.World.from_text(text) as world:
        fleet = world.fleet()
        fleet.cmd[:] = [0.5, 0, 0]
        world.step(10)
        assert fleet.stalled[0]
        assert (fleet.actual_velocity == 0).all() and (fleet.estimated_velocity == 0).all()
        assert fleet.velocity[0, 0] == 0.5
        before = fleet.estimate.copy()
        world.step(10)
        assert (fleet.estimate == before).all()


def test_a_restored_world_has_the_instant_of_its_snapshot() -> None:
    with st.World.from_text(text_of(20, "odom")) as world:
        fleet = world.fleet()
        scan = fleet.ranger()
        fleet.cmd[:] = [0.5, 0, 1.2]
        world.step(13)

        def all_of() -> list[np.ndarray]:
            return [array.copy() for array in (fleet.sensed_pose, fleet.sensed_time, fleet.estimate, scan.ranges,
                                               scan.time)]

        then, snapshot = all_of(), world.snapshot()
        world.step(7)
        world.restore(snapshot)
        for one, other in zip(all_of(), then):
            assert (one == other).all()


def distances(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distances of points from the walls, in metres."""
    return np.abs(np.maximum(np.abs(x), np.abs(y)) - 5)


@pytest.mark.parametrize(("step", "ranger", "robot"), ((100, 100, 100), (20, 100, 100), (20, 250, 40), (100, 250, 100),
                                                       (5, 30, 100)))
def test_scans_that_viewers_get_lie_on_the_walls(step: int, ranger: int, robot: int) -> None:
    """After every step, for any intervals, the scans for the page and for Foxglove lie on the walls."""
    with st.World.from_text(text_of(step, "gps", ranger, robot)) as world:
        fleet = world.fleet()
        scan = fleet.ranger()
        fleet.cmd[:] = [0.5, 0, 1.2]
        poses = {0: fleet.pose[0].copy()}  # by the end of each step, nanoseconds
        found = []
        for _ in range(2000 // step):
            world.step()
            poses[round(world.time * 1e9)] = fleet.pose[0].copy()
            for seen in unpacked_scans(world._core.scans(np.array(fleet.ids, np.uint32), 1000)):
                angles = seen.origin[2] + np.array(seen.bearings)
                found.append(distances(seen.origin[0] + seen.ranges * np.cos(angles),
                                       seen.origin[1] + seen.ranges * np.sin(angles)))
                assert seen.time == round((scan.time[0] - world.dt) * 1e9)
                if np.isfinite(seen.place[0]):
                    assert seen.place == pytest.approx(poses[seen.time], abs=1e-6)
        assert len(found) >= 2000 // step - max(1, ranger // step)
        assert told(f"viewers, steps of {step} ms, updates {ranger} and {robot} ms", found) < 1e-4  # 32-bit floats


def test_scans_in_a_picture_lie_on_the_walls() -> None:
    """Along the wall at x = 5 m, the drawn scan ends within a pixel of 5 mm."""
    text = text_of(100, "gps").replace("samples 36", "samples 3600")
    with st.World.from_text(text) as world:
        fleet = world.fleet()
        fleet.ranger()
        fleet.cmd[:] = [0, 0, 1.2]
        for _ in range(10):
            world.step()
            pictures = [world.render(400, 400, center=(5, -1), scale=200, data=data)[..., :3].astype(int)
                        for data in (True, False)]
            seen = (pictures[0] != pictures[1]).any(-1)
            assert seen.any(1).all()
            ends = np.where(seen.any(1), 400 - np.argmax(seen[:, ::-1], 1), 200)
            assert np.abs(ends - 200).max() <= 1
