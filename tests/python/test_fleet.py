# SPDX-License-Identifier: GPL-2.0-or-later
"""Fleets: live arrays of robots, and commands as NumPy arrays."""

from __future__ import annotations

import gc
import math

import numpy as np
import pytest
import stagesim as st


def test_first_program_of_the_documentation_works() -> None:
    """The first program of the documentation works and does not depend on threads."""
    found = set()
    for threads in (1, 2):
        w = st.World("hospital.world", seed=7, threads=threads)
        f = w.fleet()
        scan = f.ranger(0)
        for _ in range(60):
            front = scan.ranges[:, 6:10].min(1)
            f.cmd[:, 0] = np.clip(front - .3, 0, .5)
            f.cmd[:, 2] = np.where(front < .6, .8, 0)
            w.step()
        assert f.pose[:3].shape == (3, 3)
        assert 0 <= f.stalled.sum() <= len(f)
        found.add(w.state_hash())
    assert len(found) == 1


def test_arrays_are_what_models_say() -> None:
    world = st.World("cave.world", seed=3)
    fleet = world.fleet()
    assert list(fleet.names) == [m.name for m in world.models if m.type == "position"]
    arrays = (fleet.pose, fleet.velocity, fleet.stalled)
    for _ in range(3):
        world.step(7)
        for i, name in enumerate(fleet.names):
            robot = world.model(name)
            assert tuple(fleet.pose[i]) == robot.global_pose
            assert tuple(fleet.velocity[i]) == robot.velocity
            assert fleet.stalled[i] == robot.stalled
    assert arrays[0] is fleet.pose
    assert arrays[1] is fleet.velocity
    assert arrays[2] is fleet.stalled
    assert fleet.pose.dtype == np.float64
    assert fleet.stalled.dtype == np.bool_


def test_reading_does_not_change_the_run() -> None:
    """Reading arrays of sensors that controllers subscribe to does not change the run."""
    world = st.World("cave.world", seed=5)
    fleet = world.fleet()
    for read in (fleet.pose, fleet.energy, fleet.ranger().ranges, fleet.ranger().bearings):
        assert len(read) == len(fleet)
    world.step(50)
    alone = st.World("cave.world", seed=5)
    alone.step(50)
    assert world.state_hash() == alone.state_hash()


def test_views_but_commands_are_read_only(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet()
    for view in (fleet.pose, fleet.velocity, fleet.stalled, fleet.energy, fleet.ranger().ranges):
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 0
    fleet.cmd[...] = 1


def test_ranger_views(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet()
    scan = fleet.ranger()
    assert scan.ranges.shape == (3, 5)
    assert np.isnan(scan.ranges).all()
    assert scan.bearings[0] == pytest.approx(np.radians([-45, -22.5, 0, 22.5, 45]))
    assert scan.origins.shape == (3, 5, 2)
    world.step(2)
    assert scan.ranges[0, 2] == pytest.approx(2.95, abs=0.03)
    assert scan.intensities[0, 2] == 1
    assert scan.ranges[2, 2] == 5
    assert scan.intensities[2, 2] == 0
    assert fleet.ranger(0) is scan
    with pytest.raises(st.GoneError, match="ranger number 1"):
        fleet.ranger(1)
    with pytest.raises(ValueError, match="found -1 as index"):
        fleet.ranger(-1)


def test_ring_of_sensors_is_one_ranger() -> None:
    """Sixteen sonars have origins and bearings in the robot's frame."""
    world = st.World.from_text("""
include "sensors.inc"
position( pose [1 1 0 90] size [0.4 0.4 0.2] sonar_ring( pose [0.1 0 0 180] ) )
""")
    scan = world.fleet().ranger()
    assert scan.ranges.shape == (1, 16)
    expected = (np.arange(16) * 22.5 + 180 + 180) % 360 - 180
    assert np.cos(scan.bearings[0] - np.radians(expected)) == pytest.approx(np.ones(16))
    assert scan.origins[0, 0] == pytest.approx([0.1 - 0.18, 0])
    assert scan.origins[0, 4] == pytest.approx([0.1, -0.18])


def test_commands(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet()
    assert fleet.cmd.shape == (3, 3)
    assert not fleet.cmd.any()
    fleet.cmd[:] = [[0.5, 0, 0], [0, 0, 1], [0.3, 0, -0.5]]
    world.step()
    assert fleet.velocity == pytest.approx(fleet.cmd)
    world.step(9)
    assert fleet.pose[0] == pytest.approx([0.5, 0, 0], abs=1e-9)
    assert fleet.pose[1] == pytest.approx([0, 2, math.pi / 2 + 1], abs=1e-9)
    fleet.cmd[0] = np.nan
    fleet.cmd[1] = 0
    world.step()
    assert fleet.velocity[:2] == pytest.approx(np.array([[0.5, 0, 0], [0, 0, 0]]))


def test_commands_beside_controllers() -> None:
    """A robot with a row of NaN obeys its controller."""
    world = st.World("simple.world", seed=2)
    fleet = world.fleet()
    fleet.cmd[:] = np.nan
    world.step(40)
    alone = st.World("simple.world", seed=2)
    alone.step(40)
    assert world.state_hash() == alone.state_hash()
    fleet.cmd[0] = [0, 0, 0.1]
    before = fleet.pose.copy()
    world.step(20)
    assert (fleet.pose[0, :2] == before[0, :2]).all()
    assert (fleet.pose[1, :2] != before[1, :2]).any()


def test_choosing_robots(room: str) -> None:
    world = st.World.from_text(room + "bot( name \"d2\" pose [-5 0 0 0] )\n")
    assert world.fleet().names == ("a", "b", "c", "d2")
    assert world.fleet("[ab]").names == ("a", "b")
    assert world.fleet("position").names == ("a", "b", "c", "d2")
    assert world.fleet([world.model("c"), world.model("a")]).names == ("c", "a")
    with pytest.raises(st.GoneError):
        world.fleet("z*")
    with pytest.raises(st.GoneError, match="drive"):
        world.fleet([world.model("wall")])


def test_several_fleets_of_a_world(room: str) -> None:
    world = st.World.from_text(room)
    first, rest = world.fleet("a"), world.fleet("[bc]")
    first.cmd[:, 0] = 0.2
    rest.cmd[:, 2] = 0.4
    world.step(10)
    assert first.pose[0, 0] == pytest.approx(0.2)
    assert rest.pose[0, 2] == pytest.approx(math.pi / 2 + 0.4)


def test_other_sensors() -> None:
    world = st.World.from_text("""
resolution 0.02
model( pose [2 0 0 0] size [0.2 0.2 1] color "red" fiducial_return 9 )
define bot position( size [0.4 0.4 0.4] kWh 1.0
  fiducial( range_max 5 range_max_id 5 fov 90 )
  blobfinder( colors_count 1 colors ["red"] range 5 fov 60 image [60 40] )
  bumper( bcount 2 blength 0.2 bpose[0] [0.22 0.1 0 0] bpose[1] [-0.22 0 0 180] ) )
bot( pose [0 0 0 0] )
bot( pose [0 3 0 180] )
""".replace("kWh 1.0", "joules 1000"))
    fleet = world.fleet()
    marks, blobs, bumper = fleet.fiducials(most=3), fleet.blobs(most=2), fleet.bumper()
    assert fleet.energy[0] == 1000
    world.step(2)
    assert list(marks.count) == [1, 0]
    assert marks.id[0].tolist() == [9, 0, 0]
    assert marks.range[0, 0] == pytest.approx(2, abs=0.05)
    assert marks.bearing[0, 0] == pytest.approx(0, abs=0.05)
    assert np.isnan(marks.range[0, 1:]).all()
    assert list(blobs.count) == [1, 0]
    assert blobs.color[0, 0].tolist() == [1, 0, 0, 1]
    assert blobs.box.shape == (2, 2, 4)
    assert bumper.shape == (2, 2)
    assert not bumper.any()
    fleet.teleport([1.68, 0, 0], [0])
    world.step(2)
    assert bumper[0].tolist() == [True, False]
    assert fleet.fiducials(most=3) is marks
    with pytest.raises(st.GoneError, match="bumper number 3"):
        fleet.bumper(3)


def test_teleport(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet()
    pose = fleet.pose
    fleet.teleport([[1, 1, 0], [1, 2, 1], [1, 3, 2]])
    assert pose.tolist() == [[1, 1, 0], [1, 2, 1], [1, 3, 2]]
    fleet.teleport([[0, 0, 0]], [True, False, False])
    assert pose[0].tolist() == [0, 0, 0]
    fleet.teleport([-1, -1, 0], [2])
    assert pose[:, 0].tolist() == [0, 1, -1]
    for wrong in ([[1, 2, 3, 4]], [[1, 2]], [np.nan, 0, 0]):
        with pytest.raises(ValueError):
            fleet.teleport(wrong)


def test_views_when_models_are_made_and_deleted(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet()
    pose, ranges, cmd = fleet.pose, fleet.ranger().ranges, fleet.cmd
    cmd[:, 0] = 0.1
    world.step(3)
    world.model("b").delete()
    assert np.isnan(pose[1]).all()
    assert np.isnan(ranges[1]).all()
    assert np.isfinite(pose[[0, 2]]).all()
    world.create("position", pose=(9, 9, 0))
    world.step(3)
    assert np.isnan(pose[1]).all()
    assert pose[0, 0] == pytest.approx(0.06)
    assert np.isfinite(ranges[[0, 2]]).all()
    world.model("c").children[0].delete()
    world.step()
    assert np.isnan(ranges[2]).all()
    assert np.isfinite(pose[2]).all()


def test_views_when_the_world_is_reset_and_restored(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet()
    pose, ranges, cmd = fleet.pose, fleet.ranger().ranges, fleet.cmd
    start = pose.copy()
    cmd[:, 0] = 0.5
    world.step(4)
    now = world.snapshot()
    there, seen = pose.copy(), ranges.copy()
    world.step(5)
    world.restore(now)
    assert (pose == there).all()
    assert (ranges == seen).all()
    world.reset()
    assert (pose == start).all()
    assert np.isnan(ranges).all()
    assert not cmd.any()
    cmd[:, 0] = 0.5
    world.step(4)
    assert (pose == there).all()
    assert (ranges == seen).all()
    world.model("a").delete()
    assert np.isnan(pose[0]).all()
    world.reset()
    assert (pose == start).all()


def test_views_stay_readable_after_the_world_is_closed(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet()
    pose, cmd = fleet.pose, fleet.cmd
    world.step()
    kept = pose.copy()
    world.close()
    assert (pose == kept).all()
    cmd[...] = 1
    with pytest.raises(st.GoneError):
        _ = fleet.energy
    with pytest.raises(st.GoneError):
        fleet.ranger()
    with pytest.raises(st.GoneError):
        fleet.teleport([0, 0, 0])
    del world, fleet
    gc.collect()
    assert (pose == kept).all()
    assert cmd.sum() == 9


def test_views_outlive_the_names_of_their_world_and_fleet(room: str) -> None:
    """A view alone keeps its world alive and up to date."""
    world = st.World.from_text(room)
    pose, cmd = world.fleet().pose, world.fleet().cmd
    gc.collect()
    cmd[:, 0] = 0.5
    world.step(10)
    assert pose[0, 0] == pytest.approx(0.5)
    del world
    gc.collect()
    assert pose[0, 0] == pytest.approx(0.5)


def test_no_memory_is_lost() -> None:
    """Reference cycles of views, fleets and worlds are freed."""
    import resource

    def use() -> None:
        for _ in range(10):
            world = st.World("cave.world")
            world.fleet().ranger().ranges.sum()
            world.step()

    use()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(10):
        use()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20000


def test_commands_hold_after_their_fleet_is_collected() -> None:
    kept, dropped = (st.World("simple.world", controllers=False) for _ in range(2))
    fleet = kept.fleet()
    for moment in range(3):
        fleet.cmd[:] = (0.1 * moment, 0, 0.3)
        dropped.fleet().cmd[:] = (0.1 * moment, 0, 0.3)
        gc.collect()
        for world in (kept, dropped):
            world.step(5)
        assert dropped.state_hash() == kept.state_hash()
    last = dropped.fleet().cmd
    del dropped
    last[:] = 1
    del last
    gc.collect()
