# SPDX-License-Identifier: GPL-2.0-or-later
"""World: loading, running, state, errors, threads."""

from __future__ import annotations

import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import stagesim as st
from patience import slowness


def shipped() -> list[str]:
    return [name for name in st.shipped_worlds() if name != "arena.world"]


def test_program_has_the_same_hashes(root: Path, hashes: dict[tuple[str, int], str]) -> None:
    """The program gives the stored hashes of shipped worlds and of all stock controllers."""
    for (file, seconds), digits in hashes.items():
        if seconds > 60:
            continue
        world = st.World(root / file, seed=5, threads=1 + seconds % 2)
        world.run(seconds)
        assert world.state_hash() == digits, (file, seconds)


def test_step_run_and_clock(room: str) -> None:
    world = st.World.from_text(room, seed=3)
    assert (world.time, world.steps, world.dt, world.seed) == (0, 0, 0.1, 3)
    assert world.step() == 1
    assert world.step(9) == 9
    assert world.run(0.55) == 6
    assert world.time == pytest.approx(1.6)
    assert world.steps == 16
    assert world.step(0) == 0
    with pytest.raises(ValueError, match="quit_time"):
        world.run()
    with pytest.raises(ValueError, match="found -1 as the number of steps"):
        world.step(-1)
    with pytest.raises(ValueError, match="seconds"):
        world.run(float("nan"))


def test_quit_time_ends_run_and_nothing_else() -> None:
    world = st.World("cave.world")
    assert world.quit_time == 60
    assert world.step(595) == 595
    assert world.run() == 5
    assert world.run() == 0
    assert world.step(7) == 7
    assert world.time == pytest.approx(60.7)
    assert not world.ended


def test_reset_equals_loading() -> None:
    world = st.World("simple.world", seed=1)
    fresh = world.state_hash()
    world.step(50)
    later = world.state_hash()
    world.reset()
    assert world.state_hash() == fresh
    world.step(50)
    assert world.state_hash() == later
    world.reset(2)
    assert world.seed == 2
    world.step(50)
    other = st.World("simple.world", seed=2)
    other.step(50)
    assert world.state_hash() == other.state_hash() != later


def test_snapshot_restore_and_pickle() -> None:
    world = st.World("foraging.world", seed=4)
    world.step(30)
    now = world.snapshot()
    lean = world.snapshot(lean=True)
    assert now.time == pytest.approx(3)
    assert lean.size < now.size
    world.step(40)
    later = world.state_hash()
    for snapshot in (now, lean, pickle.loads(pickle.dumps(now)),
                     st.Snapshot.from_bytes(now.to_bytes())):
        world.restore(snapshot)
        assert world.time == pytest.approx(3)
        world.step(40)
        assert world.state_hash() == later
    other = st.World("foraging.world", seed=9)
    other.restore(now)
    other.step(40)
    assert other.state_hash() == later
    with pytest.raises(st.StageError, match="snapshot"):
        st.Snapshot.from_bytes(b"nonsense")
    with pytest.raises(st.StageError):
        st.World("simple.world").restore(now)


def test_a_fork_continues_equally_and_independently() -> None:
    world = st.World("cave.world", seed=8)
    world.step(20)
    fork = world.fork()
    assert fork.state_hash() == world.state_hash()
    fork.step(30)
    assert world.time == pytest.approx(2)
    world.step(30)
    assert fork.state_hash() == world.state_hash()
    world.close()
    assert fork.step(2) == 2


@pytest.mark.parametrize(("text", "line", "column", "message"), [
    ("\n a b c (", 2, 4, "syntax error"),
    ("position( pose [1 2 x 3] )", 1, 21, "syntax error"),
    ("robot( )", 1, 1, "expected a model type"),
    ("resolution -1", 1, 12, "not positive"),
    ("position( ctrl \"no_such_controller\" )", 1, None, "no_such_controller"),
])
def test_world_errors_have_places(text: str, line: int, column: int | None, message: str,
                                  capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(st.WorldError) as caught:
        st.World.from_text(text)
    error = caught.value
    assert message in error.message
    assert (error.file, error.line) == ("<text>", line)
    assert column is None or error.column == column
    assert capfd.readouterr() == ("", "")


def test_world_errors_in_files(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "part.inc").write_text("define bot position( size )\n")
    (tmp_path / "whole.world").write_text('include "part.inc"\nbot()\n')
    with pytest.raises(st.WorldError) as caught:
        st.World(tmp_path / "whole.world")
    assert caught.value.file == str(tmp_path / "part.inc")
    assert caught.value.line == 1
    missing = str(tmp_path / "none.world")
    with pytest.raises(st.WorldError) as caught:
        st.World(missing)
    assert (caught.value.file, caught.value.line) == (missing, None)
    assert "No such file" in caught.value.message
    assert capfd.readouterr() == ("", "")


def test_warnings_are_logged(caplog: pytest.LogCaptureFixture,
                             capfd: pytest.CaptureFixture[str]) -> None:
    with caplog.at_level(logging.WARNING, "stagesim"):
        st.World.from_text("threads 0\nmodel( siz [1 1 1] )")
    text = " ".join(record.getMessage() for record in caplog.records)
    assert "fewer than 1 thread" in text
    assert "siz" in text
    assert capfd.readouterr().out == ""


def test_arguments_are_checked() -> None:
    for arguments in ({"seed": -1}, {"seed": 2**64}, {"threads": 0}, {"threads": 2000},
                      {"ray_model": "thick"}):
        with pytest.raises(ValueError, match="found"):
            st.World("simple.world", **arguments)  # type: ignore[arg-type]


def test_controllers_can_be_left_out() -> None:
    world = st.World("simple.world", controllers=False)
    before = world.model("r0").global_pose
    world.step(20)
    assert world.model("r0").global_pose == before


def test_worlds_in_threads_run_as_they_would_alone() -> None:
    files = shipped() * 2
    alone = {}
    for seed, file in enumerate(files):
        world = st.World(file, seed=seed)
        world.step(40)
        alone[seed] = world.state_hash()
    found: dict[int, str] = {}

    def run(seed: int) -> None:
        world = st.World(files[seed], seed=seed, threads=1 + seed % 2)
        for _ in range(8):
            world.step(5)
        found[seed] = world.state_hash()

    threads = [threading.Thread(target=run, args=(seed,)) for seed in alone]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == alone


def test_step_releases_the_gil_and_refuses_a_second_user() -> None:
    world = st.World("hospital.world")
    refused = 0
    counted = 0
    thread = threading.Thread(target=world.step, args=(100,))
    thread.start()
    while thread.is_alive():
        counted += 1
        try:
            _ = world.time
        except st.StageError as error:
            assert "another thread" in str(error)
            refused += 1
    thread.join()
    assert refused > 0
    assert counted > 100
    assert world.steps == 100


def test_interrupt_leaves_the_world_intact() -> None:
    world = st.World("cave.world", seed=6)
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        world.step(10**9)
    assert time.monotonic() - start < 5 * slowness()
    timer.join()
    made = world.steps
    assert made > 0
    world.step(25)
    other = st.World("cave.world", seed=6)
    other.step(made + 25)
    assert world.state_hash() == other.state_hash()


def test_interrupt_of_a_process(tmp_path: Path) -> None:
    """Interrupts a script with SIGINT, as a terminal does."""
    script = tmp_path / "long.py"
    script.write_text("import stagesim as st, sys\n"
                      "w = st.World('hospital.world', threads=2)\n"
                      "print('ready', flush=True)\n"
                      "try:\n    w.step(10**9)\n"
                      "except KeyboardInterrupt:\n    print('stopped', w.step(), flush=True)\n")
    process = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    start = time.monotonic()
    assert process.stdout.read() == "stopped 1\n"
    assert time.monotonic() - start < 5 * slowness()
    assert process.wait() == 0


def test_use_of_a_closed_world_raises_an_error() -> None:
    with st.World("simple.world") as world:
        robot = world.model("r0")
    assert "closed" in repr(world)
    for use in (world.step, world.reset, world.snapshot, world.fork, world.state_hash,
                lambda: world.time, lambda: world.models, lambda: robot.pose, world.fleet):
        with pytest.raises(st.GoneError):
            use()
    world.close()


def test_models(room: str) -> None:
    world = st.World.from_text(room)
    robot = world.model("a")
    assert (robot.name, robot.type, robot.exists) == ("a", "position", True)
    assert [child.type for child in robot.children] == ["ranger"]
    assert robot.parent is None
    assert robot.children[0].parent == robot
    assert [m.name for m in world.models][:2] == ["wall", "a"]
    with pytest.raises(st.GoneError, match="'nobody'"):
        world.model("nobody")
    robot.pose = (1, 1, 0.5)
    assert robot.global_pose == pytest.approx((1, 1, 0.5))
    with pytest.raises(st.StageError):
        robot.pose = (float("nan"), 0, 0)
    robot.color = (0, 1, 0, 1)
    assert robot.color == (0, 1, 0, 1)
    robot.name = "alpha"
    assert world.model("alpha") == world.model("a") == robot
    for name, value in (("obstacle_return", False), ("ranger_return", 0.5), ("fiducial_return", 7),
                        ("fiducial_key", 2), ("blob_return", False), ("gripper_return", True),
                        ("speech", "hello"), ("mass", 3.5), ("size", (0.5, 0.3, 0.2)), ("z", 0.25)):
        setattr(robot, name, value)
        assert getattr(robot, name) == value, name
    assert robot.energy is None
    with pytest.raises(TypeError, match="expected a position"):
        world.model("wall").drive(1)


def test_create_drive_and_delete() -> None:
    world = st.World.from_text("resolution 0.05")
    robot = world.create("position", pose=(0, 0, 0), size=(0.3, 0.3, 0.3), name="new")
    eye = world.create("ranger", robot)
    eye.add_sensor(range=4, fov=0.5, samples=3)
    wall = world.create(pose=(2, 0, 0), size=(0.2, 5, 1))
    fleet = world.fleet()
    ranges = fleet.ranger().ranges
    robot.drive(0.5)
    world.step(10)
    assert robot.pose[0] == pytest.approx(0.5, abs=0.06)
    assert ranges[0, 1] == pytest.approx(1.9 - robot.pose[0], abs=0.1)
    wall.delete()
    assert not wall.exists
    with pytest.raises(st.GoneError):
        _ = wall.pose
    world.step(2)
    assert ranges[0, 1] == 4
    with pytest.raises(st.StageError):
        world.create("no_such_type")
    with pytest.raises(AttributeError):
        world.create("model", colour=(1, 0, 0, 1))
    assert len(world.models) == 2
    robot.go_to(0, 0)
    world.step(60)
    assert robot.pose[0] == pytest.approx(0, abs=0.1)


def test_handles_are_valid_again_after_a_snapshot_restores_their_models(room: str) -> None:
    world = st.World.from_text(room)
    now = world.snapshot()
    robot = world.model("b")
    robot.delete()
    assert not robot.exists
    world.restore(now)
    assert robot.exists
    assert robot.name == "b"


def test_handles_from_before_a_reset_stay_invalid(room: str) -> None:
    """A handle of a model from before a reset does not refer to a new model with the same id."""
    world = st.World.from_text(room)
    made = world.create(name="first")
    world.reset()
    again = world.create(name="second")
    assert again.id == made.id
    assert not made.exists
    assert world.model("a").exists


def test_program() -> None:
    """`python -m stagesim` runs the program, with the same hashes as the package."""
    command = [sys.executable, "-m", "stagesim"]
    version = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert version.stdout == f"stage {st.__version__}\n"
    run = subprocess.run([*command, "-g", "--duration", "4", "--seed", "11", "--state-hash",
                          "cave.world"], capture_output=True, text=True, check=True)
    world = st.World("cave.world", seed=11)
    world.run(4)
    assert f"state-hash {world.state_hash()}" in run.stdout


def test_a_forked_process_can_continue_the_worlds() -> None:
    """A forked child process can go on with the worlds of its parent."""
    world = st.World("hospital.world", seed=2, threads=2)
    world.step(3)
    child = os.fork()
    if child == 0:
        try:
            world.step(5)
            os._exit(0 if world.steps == 8 else 1)
        finally:
            os._exit(2)
    assert os.waitpid(child, 0)[1] == 0
    world.step(5)


@pytest.mark.parametrize(("name", "meant"), [("arena", "arena"), ("arean.world", "arena"), ("cave", "cave"),
                                             ("nowhere/simple.world", "simple"), ("nothing_like_it", None)])
def test_names_that_are_nearly_those_of_shipped_worlds_get_a_hint(name: str, meant: str | None) -> None:
    for make in (st.World, lambda file: st.Batch(file, n=1)):
        with pytest.raises(st.WorldError) as caught:
            make(name)
        assert str(caught.value).startswith(f"{name}: unable to open world file: ")
        hint = f'; did you mean "{meant}.world", which comes with Stage?'
        assert str(caught.value).endswith(hint) if meant else "did you mean" not in str(caught.value)


@pytest.mark.parametrize("name", st.shipped_worlds())
def test_shipped_worlds_load_without_a_warning(name: str, caplog: pytest.LogCaptureFixture,
                                               capfd: pytest.CaptureFixture[str]) -> None:
    with caplog.at_level(logging.WARNING), st.World(name):
        pass
    assert not caplog.records and "warning" not in capfd.readouterr().err


def test_robots_of_the_arena_see_each_other() -> None:
    with st.World("arena.world") as world:
        fleet = world.fleet()
        ranges = fleet.ranger().ranges
        fleet.teleport([(0, 0, 0), (1, 0, 0)], [0, 1])
        world.step(2)
        assert ranges[0].min() == pytest.approx(0.85, abs=0.03)
