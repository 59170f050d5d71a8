# SPDX-License-Identifier: GPL-2.0-or-later
"""Logs from Python: World.log() and Batch.log(), read by the package mcap."""

from __future__ import annotations

import math
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim import _paths

reader = pytest.importorskip("mcap.reader")
DecoderFactory = pytest.importorskip("mcap_ros2.decoder").DecoderFactory

#: Two robots with a sensor of each type. One pushes a wall, the other one turns.
ALL = """
resolution 0.02
interval_sim 100
plugins "sonar_ring"
model( name "wall" pose [1 0 0 0] size [0.1 8 1] color "red" fiducial_return 9 gripper_return 1 )
field( name "trail" size [8 8 0] field_resolution 0.1 )
light( name "lamp" pose [0.9 0.6 0 0] intensity 8 )
wifi( name "base" pose [0 -3 0 0] model "simple" range 9 alwayson 1 )
define all position( size [0.4 0.4 0.4] drive "omni" localization "gps" alwayson 1 joules 1000 joules_capacity 2000
  ranger( sensor( range [0 5] fov 90 samples 7 response [0 5 5 0] ) alwayson 1 )
  fiducial( range_max 8 range_max_id 8 fov 180 alwayson 1 )
  blobfinder( range 8 fov 60 image [40 30] alwayson 1 )
  bumper( bcount 2 blength 0.4 bpose[0] [0.21 0 0 0] alwayson 1 )
  camera( resolution [8 6] range [0.2 8] alwayson 1 )
  gripper( pose [0.25 0 0 0] size [0.1 0.1 0.1] alwayson 1 )
  actuator( type "rotational" min_position -3 max_position 3 max_speed 1 size [0.1 0.1 0.1] pose [0 0 0.4 0] alwayson 1 )
  wifi( model "simple" range 9 alwayson 1 )
  radio( range 9 alwayson 1 )
  groundsensor( deposit_rate 0.1 alwayson 1 )
  lightsensor( alwayson 1 )
  sonar_ring( count 5 reach 4 alwayson 1 ) )
all( name "a" )
all( name "b" pose [0 2 0 30] )
"""
ROOM = """
resolution 0.02
interval_sim 100
model( name "wall" pose [2 0 0 0] size [0.1 8 1] )
define bot position( size [0.4 0.4 0.4] drive "diff" localization "odom" odom_error [0.02 0.02 0 0.02]
  ranger( sensor( range [0 5] fov 180 samples 9 noise [0.01 0.01 0.01] ) alwayson 1 ) )
bot( name "a" pose [0 0 0 0] )
bot( name "b" pose [0 1.5 0 30] )
"""


def messages(file: str | Path) -> dict[str, list[tuple[int, Any]]]:
    """All messages of a log by topic: pairs of their time in nanoseconds and the decoded message."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with open(file, "rb") as stream:
        log = reader.make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in log.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def raw(file: str | Path) -> list[tuple[str, str, int, bytes]]:
    """All messages of a log in their order: topic, type, time and bytes."""
    with open(file, "rb") as stream:
        return [(channel.topic, schema.name, message.log_time, message.data)
                for schema, channel, message in reader.make_reader(stream).iter_messages(log_time_order=False)]


def nanoseconds(world: st.World) -> int:
    return round(world.time * 1e6) * 1000


def run(world: st.World, steps: int, drive: Callable[[int], None], look: Callable[[], None]) -> None:
    """Makes steps, with drive(number of the step) before each and look() after it."""
    for number in range(steps):
        drive(number)
        world.step()
        look()


def test_every_type_of_sensor_is_in_a_log_with_its_readings(tmp_path: Path) -> None:
    world = st.World.from_text(ALL)
    fleet = world.fleet()
    sensors = {kind: next(model for model in world.models if model.sensor_type == kind and model.parent is not None)
               for kind in st.sensor_types()}  # of robot "a"; a new type needs a place in the world
    seen: dict[tuple[str, int], dict[str, np.ndarray]] = {}

    def drive(number: int) -> None:
        fleet.cmd[:] = [[0.8, 0, 0], [0.1, 0, 1]]
        fleet.send(bytes([number]))

    def look() -> None:
        for kind, sensor in sensors.items():
            seen[kind, nanoseconds(world)] = {name: value.copy() for name, value in sensor.readings.items()}

    with world.log(tmp_path / "all.mcap"):
        run(world, 12, drive, look)
    found = messages(tmp_path / "all.mcap")
    for kind in sensors:
        logged = dict(found[f"/a/readings/{kind}"])
        assert sorted(logged) == [time for of, time in seen if of == kind], kind
        for time, message in logged.items():
            assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == time
            for name, values in seen[kind, time].items():
                found_values = getattr(message, name)
                array = np.frombuffer(found_values, np.uint8) if isinstance(found_values, bytes) else np.ravel(found_values)
                np.testing.assert_array_equal(array, values.ravel(), f"{kind}.{name}")
    last = {kind: found[f"/a/readings/{kind}"][-1][1] for kind in sensors}
    assert last["wifi"].count == 2 and last["radio"].count == 1 and last["fiducial"].id == [9]
    assert any(last["gripper"].contacts) or any(last["gripper"].beams) or max(last["bumper"].hit)
    assert last["groundsensor"].value[0] > 0 and last["lightsensor"].intensity[0] > 0
    times = [time for of, time in seen if of == "ranger"]
    scans = dict(found["/a/base_scan0"] if "/a/base_scan0" in found else found["/a/base_scan"])
    assert sorted(scans) == times
    for time in times:
        assert np.float32(seen["ranger", time]["ranges"]) == pytest.approx(
            np.where(np.isinf(scans[time].ranges), 5, scans[time].ranges))


def test_commands_have_the_stamp_of_the_step_that_obeys_them(tmp_path: Path) -> None:
    world = st.World.from_text(ROOM)
    fleet = world.fleet("a")
    other = world.model("b")
    given: dict[int, tuple[float, float]] = {}

    def drive(number: int) -> None:
        fleet.cmd[0] = [0.01 * number, 0, -0.1 * number]
        given[nanoseconds(world) + 10**8] = 0.01 * number, -0.1 * number
        if number == 5:
            other.go_to(1, 1.5)
        elif number < 5:
            other.drive(0.2)

    obeyed = {}

    def look() -> None:
        velocity = world.model("a").velocity
        obeyed[nanoseconds(world)] = velocity[0], velocity[-1]

    with world.log(tmp_path / "run.mcap"):
        run(world, 10, drive, look)
    found = messages(tmp_path / "run.mcap")
    logged = {time: (twist.twist.linear.x, twist.twist.angular.z) for time, twist in found["/a/cmd_vel"]}
    assert logged == given == obeyed
    assert {twist.header.frame_id for _, twist in found["/a/cmd_vel"]} == {"a/base_link"}
    stamps = [twist.header.stamp.sec * 10**9 + twist.header.stamp.nanosec for _, twist in found["/a/cmd_vel"]]
    assert stamps == list(given)
    assert [time // 10**8 for time, _ in found["/b/cmd_vel"]] == [1, 2, 3, 4, 5]
    assert {twist.twist.linear.x for _, twist in found["/b/cmd_vel"]} == {0.2}
    assert [time // 10**8 for time, _ in found["/b/cmd_pose"]] == [6, 7, 8, 9, 10]
    goal = found["/b/cmd_pose"][0][1]
    assert (goal.pose.position.x, goal.pose.position.y, goal.header.frame_id) == (1, 1.5, "b/odom")


def test_robots_that_update_rarely_obey_late(tmp_path: Path) -> None:
    world = st.World.from_text(ROOM.replace('drive "diff"', 'drive "diff" update_interval 300'))
    fleet = world.fleet()

    def drive(number: int) -> None:
        fleet.cmd[:, 0] = 0.01 * (number + 1)

    with world.log(tmp_path / "run.mcap"):
        run(world, 9, drive, lambda: None)
    logged = [(time // 10**8, round(100 * twist.twist.linear.x))
              for time, twist in messages(tmp_path / "run.mcap")["/a/cmd_vel"]]
    assert [number for number, _ in logged] == [speed for _, speed in logged] and len(logged) == 3


def test_contacts_are_those_of_the_world(tmp_path: Path) -> None:
    world = st.World.from_text(ROOM.replace("[2 0 0 0]", "[0.6 0 0 0]"))
    fleet = world.fleet()
    touched: dict[int, list[tuple[float, float]]] = {}

    def drive(number: int) -> None:
        fleet.cmd[0] = [0.5 if number < 8 else -0.5, 0, 0]

    def look() -> None:
        x, y, heading = fleet.pose[0]
        points = [(point[0] - x, point[1] - y) for point in world.contacts().points]
        c, s = math.cos(heading), math.sin(heading)
        places = sorted((c * dx + s * dy, c * dy - s * dx) for dx, dy in points)
        if places or touched.get(nanoseconds(world) - 10**8):
            touched[nanoseconds(world)] = places

    with world.log(tmp_path / "run.mcap", models="a"):
        run(world, 12, drive, look)
    logged = dict(messages(tmp_path / "run.mcap")["/a/contacts"])
    assert list(logged) == list(touched) and max(map(len, touched.values())) == 2
    for time, message in logged.items():
        assert message.markers[0].action == 3 and message.markers[0].header.frame_id == "a/base_footprint"
        arrows = message.markers[1:]
        assert [(arrow.pose.position.x, arrow.pose.position.y) for arrow in arrows] == [
            pytest.approx(place, abs=1e-12) for place in touched[time]]
        assert {arrow.text for arrow in arrows} <= {"wall"}
        for arrow in arrows:  # away from the robot
            assert 2 * math.atan2(arrow.pose.orientation.z, arrow.pose.orientation.w) == pytest.approx(0, abs=1e-9)
    assert not touched[list(touched)[-1]], "the last message deletes the arrows"


def test_robots_that_touch_each_other_have_arrows_to_the_other(tmp_path: Path) -> None:
    world = st.World.from_text(ROOM.replace("[0 1.5 0 30]", "[0.5 0 0 180]"))
    fleet = world.fleet()
    with world.log(tmp_path / "run.mcap"):
        run(world, 4, lambda _: fleet.cmd.__setitem__(slice(None), [0.3, 0, 0]), lambda: None)
    found = messages(tmp_path / "run.mcap")
    for own, other in (("a", "b"), ("b", "a")):
        arrows = found[f"/{own}/contacts"][-1][1].markers[1:]
        assert arrows and {arrow.text for arrow in arrows} == {other}
        for arrow in arrows:  # both face each other
            assert arrow.pose.position.x == pytest.approx(0.2, abs=1e-3) and abs(arrow.pose.position.y) < 0.21
            assert abs(arrow.pose.orientation.z) < 1e-9


def test_batteries(tmp_path: Path) -> None:
    world = st.World.from_text(ALL)
    stored: dict[int, float] = {0: world.model("a").energy}
    with world.log(tmp_path / "run.mcap"):
        run(world, 25, lambda _: None, lambda: stored.update({nanoseconds(world): world.model("a").energy}))
    logged = messages(tmp_path / "run.mcap")["/a/battery"]
    changes = [time for i, time in enumerate(stored) if i == 0 or stored[time] != list(stored.values())[i - 1]]
    assert set(changes) <= {time for time, _ in logged} and len(changes) > 2
    for time, state in logged:
        assert state.percentage == np.float32(stored[time] / 2000) and state.present and math.isnan(state.voltage)
        assert (state.power_supply_status == 2) == (time in changes and time > 0)


def test_logs_are_equal_to_those_of_the_program(tmp_path: Path) -> None:
    file = Path(_paths.WORLDS[0], "simple.world")
    subprocess.run([_paths.PROGRAM, "-g", "--duration", "3", "--seed", "4", "--log", tmp_path / "program.mcap",
                    "--log-models", "r0,r1", "--log-every", "0.5", "--log-ranges", "stage", file], check=True,
                   capture_output=True)
    world = st.World(file, seed=4)
    with world.log(tmp_path / "python.mcap", models=["r0", "r1"], every=0.5, ranges="stage"):
        world.run(3)
    assert (tmp_path / "python.mcap").read_bytes() == (tmp_path / "program.mcap").read_bytes()
    plain = st.World(file, seed=4)
    plain.run(3)
    assert plain.state_hash() == world.state_hash()


# ---- batches ----


def commands(number: int, worlds: int) -> np.ndarray:
    """Commands of two robots in each world before step `number`, which differ between worlds and steps."""
    return np.array([[[0.1 * (1 + i), 0, 0.2 * number], [0.3, 0, -0.1 * i]] for i in range(worlds)])


def alone(text: str, file: Path, steps: int, seed: int, **options: Any) -> st.World:
    """A world alone that is driven like world `seed` of a batch of three."""
    world = st.World.from_text(text, seed=seed, **options)
    fleet = world.fleet()
    with world.log(file):
        run(world, steps, lambda number: fleet.cmd.__setitem__(slice(None), commands(number, 3)[seed]), lambda: None)
    return world


def check_batch(tmp_path: Path, text: str, closed: bool, device: str | None = None) -> None:
    batch = st.Batch.of(st.World.from_text(text), 3, threads=2, device=device)
    assert (batch.explain()[0] is None) == closed
    log = batch.log(tmp_path / "batch-{}.mcap", [2, 0])
    assert log.files == tuple(str(tmp_path / f"batch-{i}.mcap") for i in (2, 0))
    for number in range(8):
        batch.cmd[...] = commands(number, 3)
        batch.step()
    log.close()
    for i in (0, 2):
        world = alone(text, tmp_path / f"alone-{i}.mcap", 8, i)
        assert batch.state_hash(i) == world.state_hash()
        assert raw(tmp_path / f"batch-{i}.mcap") == raw(tmp_path / f"alone-{i}.mcap")
    topics = {topic for topic, *_ in raw(tmp_path / "batch-2.mcap")}
    assert {"/a/cmd_vel", "/a/base_scan", "/a/odom", "/b/ground_truth", "/tf", "/map", "/stage/poses"} <= topics


def test_a_world_in_a_row_has_the_log_of_the_same_world_alone(tmp_path: Path) -> None:
    check_batch(tmp_path, ROOM, closed=True)


def test_a_world_with_objects_has_the_log_of_the_same_world_alone(tmp_path: Path) -> None:
    check_batch(tmp_path, ROOM.replace("bot( name", "bot( gripper( pose [0.25 0 0 0] size [0.1 0.1 0.1] ) name"), closed=False)


def test_a_world_on_a_device_has_the_log_of_the_same_world_alone(tmp_path: Path) -> None:
    try:
        check_batch(tmp_path, 'contacts "cells"' + ROOM, closed=True, device="opencl")
    except st.StageError as error:
        if "OpenCL" not in str(error):
            raise
        pytest.skip(f"skipped: {error}")


def test_rollouts_of_logged_worlds_are_equal(tmp_path: Path) -> None:
    logged, plain = (st.Batch.of(st.World.from_text(ROOM), 3, threads=1) for _ in range(2))
    given = np.array([commands(number, 3) for number in range(4)])
    with logged.log(tmp_path / "run.mcap", 1):
        found = logged.rollout(given, n=2, record=("pose", "ranges"))
    expected = plain.rollout(given, n=2, record=("pose", "ranges"))
    for name, array in expected.items():
        np.testing.assert_array_equal(found[name], array, name)
    assert logged.state_hashes() == plain.state_hashes()
    speeds = [twist.twist.linear.x for _, twist in messages(tmp_path / "run.mcap")["/a/cmd_vel"]]
    assert speeds == [0.2] * 8


def test_a_log_ends_when_its_world_goes_back_in_time(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    batch = st.Batch.of(st.World.from_text(ROOM), 2, threads=1)
    log = batch.log(tmp_path / "run.mcap")
    batch.step(3)
    batch.reset()
    batch.step(9)
    log.close()
    assert "the log ends at 0.3" in caplog.text and "set back" in caplog.text
    assert [time // 10**8 for time, _ in messages(tmp_path / "run.mcap")["/clock"]] == [0, 1, 2, 3]
    world = st.World.from_text(ROOM)
    with world.log(tmp_path / "run.mcap"):
        world.step(2)
        world.reset()
        world.step(5)
    assert [time // 10**8 for time, _ in messages(tmp_path / "run.mcap")["/clock"]] == [0, 1, 2]


def test_logs_end_with_their_objects(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    with st.World.from_text(ROOM) as world:
        log = world.log(file)
        world.step(2)
        assert not log.closed and repr(log) == f"<Log {str(file)!r}>"
    assert log.closed and repr(log).endswith(", closed>")
    assert [time // 10**8 for time, _ in messages(file)["/clock"]] == [0, 1, 2]
    world = st.World.from_text(ROOM)
    log = world.log(file)
    world.step()
    del log
    world.step()
    assert [time // 10**8 for time, _ in messages(file)["/clock"]] == [0, 1]


def is_in_use(world: st.World | st.Batch) -> bool:
    """True while another thread is using the world or batch."""
    try:
        world.time  # noqa: B018
    except st.StageError:
        return True
    return False


def test_a_forgotten_log_is_completed_when_its_world_is_free(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    for world in (st.World.from_text(ROOM), st.Batch.of(st.World.from_text(ROOM), 2, threads=1)):
        log = world.log(file, every=10)
        thread = threading.Thread(target=world.step, args=(50_000,))
        thread.start()
        while not is_in_use(world):
            assert thread.is_alive(), "the run is too short for this test"
        del log
        with pytest.raises(st.StageError, match="another log is being written there"):
            st.World.from_text(ROOM).log(file)
        thread.join()
        assert [time // 10**9 for time, _ in messages(file)["/clock"]] == list(range(0, 5001, 10))
        st.World.from_text(ROOM).log(file).close()


def test_wrong_arguments_have_one_clear_line(tmp_path: Path) -> None:
    world, batch = st.World.from_text(ROOM), st.Batch.of(st.World.from_text(ROOM), 3, threads=1)
    (tmp_path / "text").write_text("This is no log.")
    for error, call in (
            ("can't be written", lambda: world.log(tmp_path / "none" / "x.mcap")),
            ("not an MCAP", lambda: world.log(tmp_path / "text")),
            ("models: found no robot called \"x\"", lambda: world.log(tmp_path / "x.mcap", models="x")),
            ("expected a number of seconds", lambda: world.log(tmp_path / "x.mcap", every=-1)),
            ("found no names in models", lambda: world.log(tmp_path / "x.mcap", models=[])),
            ("expected lz4, zstd, none", lambda: world.log(tmp_path / "x.mcap", compression="zip")),
            ("expected rep117 or stage", lambda: world.log(tmp_path / "x.mcap", ranges="all")),
            ("expected the name of a file", lambda: world.log("")),
            ("out of bounds", lambda: batch.log(tmp_path / "x.mcap", 3)),
            ("expected a name with {}", lambda: batch.log(tmp_path / "x.mcap", [0, 1])),
            ("found the same world twice", lambda: batch.log(tmp_path / "x.mcap", [1, 1])),
            ("expected one or more", lambda: batch.log(tmp_path / "x.mcap", []))):
        with pytest.raises((st.StageError, ValueError, IndexError)) as caught:
            call()
        assert error in str(caught.value) and "\n" not in str(caught.value)
    with world.log(tmp_path / "x.mcap"), pytest.raises(st.StageError, match="another log is being written there"):
        world.log(tmp_path / "x.mcap")
