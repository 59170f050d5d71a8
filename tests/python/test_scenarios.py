# SPDX-License-Identifier: GPL-2.0-or-later
"""Scenarios with pedestrians: their scenes, how people walk in them, and the metrics."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim import scenarios, scenes
from stagesim.scenarios.__main__ import main
from snippets import check_outputs

NAMES = list(scenarios.names())
WALKER = 'position( size [0.4 0.4 1.7] round 1 drive "omni" velocity_bounds [-3 3 -3 3 0 0 -180 180] '


def ran(name: str, seed: int = 0, **options) -> tuple[scenarios.Scenario, scenarios.Recording, dict]:
    """A scenario without a robot, its recording and what the metrics say."""
    made = scenarios.scenario(name, seed, robot=False, **options)
    run = scenarios.record(st.World.of(made.scene), made.horizon)
    return made, run, scenarios.measures(made, run)


# ---- scenes ----


@pytest.mark.parametrize("name", NAMES)
def test_nobody_touches_another_at_first(name: str) -> None:
    for seed in range(3):
        made = scenarios.scenario(name, seed)
        world = st.World.of(made.scene)
        fleet = world.fleet()
        assert made.robot == "robot" and tuple(fleet.names) == ("robot", *made.people)
        places = fleet.pose[:, :2]
        gaps = np.sqrt(((places[:, None] - places)**2).sum(-1)) - made.radii - made.radii[:, None]
        assert gaps[~np.eye(len(places), dtype=bool)].min() > 0.1
        assert fleet.pose[0] == pytest.approx(made.start)
        for _ in range(3):
            world.step()
            assert not fleet.stalled.any()  # walls are free, too


@pytest.mark.parametrize("name", NAMES)
def test_people_arrive_and_equal_seeds_walk_equally(name: str) -> None:
    made, run, found = ran(name, 1)
    assert len(made.people) >= 5 and len(made.speeds) == len(made.people)
    assert (scenarios.path_lengths(run.pose) > 2).all()
    if np.isfinite(made.goals).all():
        assert found["arrived"] >= 0.85
    assert np.array_equal(run.pose, ran(name, 1)[1].pose)
    assert not np.array_equal(run.pose, ran(name, 2)[1].pose)


def test_speeds_are_distributed_as_published() -> None:
    speeds = np.concatenate([scenarios.scenario("hall", seed, pedestrians=200).speeds for seed in range(5)])
    assert speeds.mean() == pytest.approx(1.34, abs=0.03) and speeds.std() == pytest.approx(0.26, abs=0.02)


def test_rooms_without_enough_room_and_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="found no room for all pedestrians of the scenario 'corridor', expected fewer"):
        scenarios.scenario("corridor", pedestrians=2000)
    with pytest.raises(ValueError, match="found the scenario 'lift', expected one of: corridor, crossing"):
        scenarios.scenario("lift")
    with pytest.raises(ValueError, match="found the rule 'cellular', expected one of: pedestrian, orca"):
        scenarios.scenario("door", rule="cellular")
    with pytest.raises(ValueError, match="found -1 as the number of pedestrians"):
        scenarios.scenario("door", pedestrians=-1)
    with pytest.raises(TypeError, match="found the robot 'r', expected True, False or a Robot"):
        scenarios.scenario("door", robot="r")  # type: ignore[arg-type]


def test_a_robot_of_ones_own_gets_the_route() -> None:
    robot = scenes.Robot(size=(0.4, 0.3, 0.5), ctrl=["stage/orca goals={goals}", "stage/goal x={x} y={y}"])
    made = scenarios.scenario("door", robot=robot)
    text = made.scene.text()
    assert '"stage/orca goals=0.3,0,4,0" "stage/goal x=4 y=0"' in text
    assert made.radii[0] == pytest.approx(0.25) and made.via == ((0.3, 0),)


# ---- how people walk ----


@pytest.mark.parametrize("rule", ["pedestrian", "orca"])
def test_two_people_who_meet_head_on_pass_each_other(rule: str) -> None:
    more = " repulsion=7 reach=0.4" if rule == "pedestrian" else ""
    for offset in (0.05, 0.1, -0.3):
        world = st.World.from_text("".join(
            WALKER + f'pose [{-x} {y} 0 0] ctrl "stage/{rule} x={x} y={y} speed=1.3 radius=0.2{more}" )\n'
            for x, y in ((5, 0.01), (-5, offset))))
        fleet = world.fleet()
        for _ in range(150):
            world.step()
            assert rule == "pedestrian" or not fleet.stalled.any()
        assert abs(fleet.pose[:, 0] - (5, -5)).max() < 0.5


def test_reciprocal_avoidance_in_the_open_has_no_collision_in_thirty_seeds() -> None:
    many = [scenarios.scenario("crossing", seed, robot=False, rule="orca") for seed in range(30)]
    batch = st.Batch.of([each.scene for each in many], 30)
    run = scenarios.record(batch, 40)
    found = scenarios.measures(many, run)
    assert found["stopped"].shape == (30,) and not found["stopped"].any()
    assert found["arrived"].mean() > 0.99
    apart = np.sqrt(((run.pose[:, :, :, None, :2] - run.pose[:, :, None, :, :2])**2).sum(-1))
    assert apart[..., ~np.eye(20, dtype=bool)].min() > 0.4  # twice the radius


def test_more_people_walk_slower_and_need_longer_to_leave() -> None:
    speeds, durations = [], []
    for people in (5, 20, 80):
        made, run, _ = ran("evacuation", 3, pedestrians=people)
        moved = scenarios.path_lengths(run.pose[:80]) / (79 * run.dt)
        speeds.append((moved / made.speeds).mean())
        assert made.gate is not None
        durations.append(np.nanmax(scenarios.crossing_times(run.pose, made.gate, run.dt)))
    assert speeds[0] > speeds[1] + 0.1 and speeds[1] > speeds[2] + 0.1
    assert durations[0] < durations[1] < durations[2]


def test_the_flow_through_a_door_is_of_the_size_that_was_observed() -> None:
    """Observed are 1.2 to 1.9 persons per second and metre; people who stop when they touch are at the lower end."""
    for rule, least, most in (("pedestrian", 0.8, 2.3), ("orca", 1.2, 3.0)):
        found = [float(ran("evacuation", seed, rule=rule)[2]["flow"]) for seed in range(3)]
        assert least < np.mean(found) < most, rule


def test_people_reach_the_counter_in_the_order_of_the_queue() -> None:
    made, run, _ = ran("queue", 4)
    times = scenarios.arrival_times(run.pose, (0.2, 0), run.dt, near=0.25)
    assert (np.diff(times) > 0).all()
    assert times[-1] - times[0] > 10


def test_groups_stay_together() -> None:
    world = st.World.from_text("".join(
        WALKER + f'pose [0 {0.8 * k} 0 0] ctrl "stage/pedestrian x=60 y={0.8 * k} speed={1.0 + 0.3 * k} '
        f'radius=0.2 group=3 member={k + 1}" )\n' for k in range(3)))
    world.step(300)
    places = world.fleet().pose[:, :2]
    assert places[:, 0].min() > 25 and np.ptp(places, axis=0).max() < 3


# ---- metrics ----


def test_metrics_of_known_paths() -> None:
    time = np.arange(11)
    robot = np.stack([time * 1.0, np.zeros(11)], -1)
    people = np.stack([np.tile([5.0, 1.0], (11, 1)), np.tile([5.0, 9.0], (11, 1))], 1)
    assert scenarios.arrival_times(robot, (7, 0), 0.5) == pytest.approx(3.5)
    assert scenarios.arrival_times(robot, (6.4, 0), 0.5) == pytest.approx(3.0)
    assert np.isnan(scenarios.arrival_times(robot, (7, 1), 0.5))
    assert scenarios.path_lengths(robot) == pytest.approx(10)
    assert scenarios.closest_distances(robot, people) == pytest.approx([1, 9])
    assert scenarios.closest_distances(robot, people, [0.5, 1]) == pytest.approx([0.5, 8])
    assert scenarios.intrusion_times(robot, people, 0.5) == pytest.approx(0.5)  # at x = 5 alone
    assert scenarios.intrusion_times(robot, people, 0.5, 1.5) == pytest.approx(1.5)
    assert scenarios.intrusion_times(robot, people, 0.5, scenarios.INTIMATE) == 0
    assert scenarios.collisions([True, True, False, True, False, False]) == 2
    assert scenarios.collisions(np.zeros((4, 3, 2))).shape == (3, 2)


def test_crossings_of_a_gate_have_a_direction_and_an_extent() -> None:
    path = np.array([[[-1, 0], [-1, 2], [1, 0]], [[1, 0], [1, 2], [-1, 0]], [[1, 0], [1, 2], [1, 0]]], float)
    gate = [[0, 0.5], [0, -0.5]]
    times = scenarios.crossing_times(path, gate, 2.0)
    assert times == pytest.approx([2.0, np.nan, 4.0], nan_ok=True)
    assert scenarios.flow(times) == pytest.approx(0.5)
    assert np.isnan(scenarios.flow([[1.0, np.nan], [np.nan, np.nan]])).all()


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match=r"found a path of shape \(3,\), expected \(t, ..., 2 or more\)"):
        scenarios.path_lengths([1, 2, 3])
    with pytest.raises(ValueError, match=r"found a robot of shape \(4, 2\) and people of shape \(5, 1, 2\)"):
        scenarios.closest_distances(np.zeros((4, 2)), np.zeros((5, 1, 2)))
    made, run, _ = ran("group")
    with pytest.raises(ValueError, match="found 1 scenarios and poses of shape"):
        scenarios.measures([made], run)


def test_metrics_of_a_batch_and_of_a_world_are_equal() -> None:
    robot = scenes.Robot(size=(0.5, 0.5, 0.5), drive="omni", ctrl="stage/orca goals={goals} speed=0.8")
    many = [scenarios.scenario("counterflow", seed, robot=robot) for seed in range(3)]
    batch = scenarios.measures(many, scenarios.record(st.Batch.of([each.scene for each in many], 3), 20))
    for i, each in enumerate(many):
        world = st.World.of(each.scene)
        alone = scenarios.measures(each, scenarios.record(world, 20))
        assert {name: float(values[i]) for name, values in batch.items()} == pytest.approx(
            {name: float(value) for name, value in alone.items()}, nan_ok=True)
        assert world.metrics["distance"] == pytest.approx(alone["path_length"], abs=0.2)
    assert (batch["closest"] < 1.2).all() and (batch["personal"] > 1).all() and (batch["path_length"] > 5).all()


def test_branches_of_a_scenario_are_measured() -> None:
    made = scenarios.scenario("corridor", 2)
    world = st.World.of(made.scene)
    world.step(20)
    closest = []
    for speed in (0.0, 0.8):
        branch = world.fork()
        branch.fleet().cmd[0, 0] = speed
        closest.append(scenarios.measures(made, scenarios.record(branch, 5))["path_length"])
    assert closest[0] < 0.2 < 3 < closest[1]


def test_branches_of_a_batch_go_on_like_their_world() -> None:
    robot = scenes.Robot(size=(0.5, 0.5, 0.5), drive="omni", ctrl="stage/orca goals={goals} speed=0.8")
    many = [scenarios.scenario("hall", seed, robot=robot) for seed in range(3)]
    batch = st.Batch.of([each.scene for each in many], 3)
    batch.step(30)
    branch = batch.fork(1)
    run, alone = scenarios.record(batch, 5), scenarios.record(branch, 5)
    assert np.array_equal(run.pose[:, 1], alone.pose) and np.array_equal(run.stalled[:, 1], alone.stalled)
    assert not np.array_equal(run.pose[:, 2], alone.pose)
    assert run.dt == pytest.approx(alone.dt)  # the time of the batch is a difference of larger numbers


# ---- environments ----


def ranges_alone(scene: scenes.Scene, actions: int, **options: Any) -> np.ndarray:
    """Ranges of the robot after each action of two steps, in a world of its own."""
    world = st.World.of(scene, **options)
    fleet = world.fleet("robot")
    ranges = fleet.sensor("ranger").ranges
    world.step()
    found = []
    for _ in range(actions):
        fleet.cmd[0, 0] = 0.5
        world.step(2)
        found.append(ranges[0].copy())
    return np.array(found)


def ranges_in(environment: Any, actions: int) -> np.ndarray:
    """Ranges of the robots of all worlds after each action."""
    environment.reset(seed=list(range(environment.num_envs)))
    for _ in range(actions):
        environment.step(np.tile(np.float32([1, 0]), (environment.num_envs, 1)))
    return np.array(environment.task.seen)


def navigate() -> Any:
    """A task that starts where the scene says, and keeps the ranges."""
    pytest.importorskip("gymnasium")
    from stagesim.env.tasks import Navigate

    class Straight(Navigate):
        def __init__(self) -> None:
            super().__init__()
            self.seen: list[np.ndarray] = []

        def begin(self, scene: Any, randoms: Any) -> None:
            super().begin(scene, randoms)

        def judge(self, scene: Any) -> Any:
            self.seen.append(scene.ranges[:, 0].copy())
            return super().judge(scene)

    return Straight()


@pytest.mark.parametrize("rule", ["pedestrian", "orca"])
def test_people_of_an_environment_walk_like_those_of_the_world(rule: str) -> None:
    task = navigate()
    from stagesim.env import StageVectorEnv

    made = scenarios.scenario("hall", 1, rule=rule)
    environment = StageVectorEnv(3, made.scene, task, robots="robot")
    assert environment.agents == ("robot",)
    found, expected = ranges_in(environment, 20), ranges_alone(made.scene, 20)
    for i in range(3):
        assert np.array_equal(found[:, i], expected)
    assert not np.array_equal(expected, ranges_alone(made.scene, 20, controllers=False))  # the robot sees people who walk


def test_each_episode_has_another_scenario() -> None:
    task = navigate()
    from stagesim.env import StageVectorEnv

    drawn: list[scenes.Scene] = []

    def hall(random: np.random.Generator) -> scenes.Scene:
        drawn.append(scenarios.scenario("hall", int(random.integers(1000))).scene)
        return drawn[-1]

    environment = StageVectorEnv(3, scenarios.scenario("hall", 0).scene, task, robots="robot", maps=hall)
    for _ in range(2):
        task.seen.clear()
        drawn.clear()
        found = ranges_in(environment, 5)
        assert len(drawn) == 3
        for i, scene in enumerate(drawn):
            assert np.array_equal(found[:, i], ranges_alone(scene, 5))
    assert not np.array_equal(found[:, 0], found[:, 1])


# ---- files, sweeps and the page ----


def test_saved_scenarios_run_equally(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["corner", "--seed", "3", "--save", str(tmp_path), "--robot", "none"]) == 0
    world = st.World(capsys.readouterr().out.strip())
    scene = scenarios.scenario("corner", 3, robot=False).scene
    assert world.quit_time == 60 and world.state_hash() == st.World.of(scene).state_hash()
    assert main(["--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == NAMES
    assert main(["lift", "--save", str(tmp_path)]) == 1
    assert capsys.readouterr().err.startswith("stagesim.scenarios: found the scenario 'lift', expected one of")


def test_pictures_show_walls_paths_and_the_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    made = scenarios.scenario("counterflow", 1)
    run = scenarios.record(st.World.of(made.scene), 8)
    for time, poses in ((None, 81), (2, 21)):
        figure, axes = pyplot.subplots()
        scenarios.draw(axes, made, run, time)
        walls, bodies = ([patch for patch in axes.patches if type(patch).__name__ == kind]
                         for kind in ("Rectangle", "Circle"))
        assert len(walls) == 2 and walls[0].get_bbox().size == pytest.approx((0.2, 4.5))
        assert [body.center for body in bodies] == [pytest.approx(place) for place in run.pose[poses - 1, :, :2]]
        assert bodies[1].radius == pytest.approx(0.2)
        paths = [line.get_xydata() for line in axes.lines]
        assert np.array_equal(paths[0], run.pose[:poses, 0, :2]) and np.array_equal(paths[-1], [made.goal])
        assert np.array_equal(paths[1], run.pose[max(0, poses - 31):poses, 0, :2])
        pyplot.close(figure)
    with pytest.raises(ValueError, match="found the time 9 s, expected 0 to 8 s"):
        scenarios.draw(None, made, run, 9)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"expected \(t, 13, 3\): those of a single world"):
        scenarios.draw(None, made, run._replace(pose=run.pose[:, None]))  # type: ignore[arg-type]
    file = tmp_path / "corner.png"
    assert main(["corner", "--picture", str(file), "--seconds", "1"]) == 0 and capsys.readouterr().out == ""
    assert file.read_bytes().startswith(b"\x89PNG")
    for words, message in ((["--picture", str(tmp_path / "a.none")], "Format 'none' is not supported"),
                           (["--picture", str(file), "--seconds", "nan"], "found nan seconds, expected 0 or more")):
        assert main(["corner", *words]) == 1
        assert capsys.readouterr().err.startswith(f"stagesim.scenarios: {message}")


def test_sweeps_measure_scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from stagesim.sweep import Experiment, run

    monkeypatch.chdir(tmp_path)
    assert main(["counterflow", "--save", "."]) == 0
    results = run(Experiment("counterflow.world", {"robot.mass": [1, 2]}, runs=1, duration=15,
                             metrics="stagesim.scenarios:Social"), out="out", jobs=1)
    table = results.table()
    made = scenarios.scenario("counterflow", robot=False)
    world = st.World("counterflow.world")
    pose = scenarios.record(world, 15).pose
    expected = scenarios.closest_distances(pose[1:, 0], pose[1:, 1:]).min()
    assert len(made.people) == pose.shape[1] - 1
    assert table["closest"] == pytest.approx([expected] * 2) and (table["personal"] > 0).all()
    assert table["distance"] == pytest.approx([scenarios.path_lengths(pose[:, 0])] * 2, abs=0.2)


def test_page_prints_what_it_shows(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each block of Python in docs/people.md, executed in order, prints the output that follows it."""
    page = root / "docs" / "people.md"
    if not page.exists():
        pytest.skip("there is no docs/people.md")
    monkeypatch.chdir(tmp_path)
    assert check_outputs(page) >= 3


def test_the_command_of_the_page_writes_a_file(root: Path, tmp_path: Path) -> None:
    page = root / "docs" / "people.md"
    if not page.exists():
        pytest.skip("there is no docs/people.md")
    (words,) = re.findall(r"^    python (-m stagesim\.scenarios .*)$", page.read_text(encoding="utf-8"), re.M)
    done = subprocess.run([sys.executable, *words.split()], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout == "people/corridor.world\n" and not done.stderr
    assert len(st.World(tmp_path / "people" / "corridor.world").fleet()) == 21
