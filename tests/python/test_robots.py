# SPDX-License-Identifier: GPL-2.0-or-later
"""The robots and lidars of worlds/robots have the numbers of the tables in docs/robots.md."""

from __future__ import annotations

import logging
import math
import re
from pathlib import Path

import numpy as np
import pytest
import stagesim as st
from conftest import ROOT

FOLDER = ROOT / "worlds" / "robots"


def table(heading: str) -> dict[str, list[str]]:
    """The rows of the first table below a heading of docs/robots.md, by the name of the macro."""
    section = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in section.splitlines() if line.startswith("| `")]
    return {row[0].strip("`"): row[1:] for row in rows}


ROBOTS, LIDARS = table("Robots"), table("Lidars")


def numbers(cell: str) -> list[float]:
    return [float(text) for text in re.findall(r"-?\d+(?:\.\d+)?", cell)]


def one(macro: str, more: str = "") -> st.World:
    """An open field with one robot at the origin."""
    return st.World.from_text(f'include "robots/{macro}.inc"\ninterval_sim 20\nray_model "exact"\n{more}\n'
                              f'{macro}( name "r" update_interval 20 )\n')


def test_each_file_is_in_the_tables() -> None:
    assert {path.stem for path in FOLDER.glob("*.inc")} == {*ROBOTS, "lidars"}
    assert {path.stem for path in FOLDER.glob("*.world")} == set(ROBOTS)
    defined = re.findall(r"^define (\w+) ranger", (FOLDER / "lidars.inc").read_text(), re.MULTILINE)
    assert set(defined) == {*LIDARS, *(f"{macro}_sweep" for macro in LIDARS)}


@pytest.mark.parametrize("macro", ROBOTS)
def test_its_world_loads_without_a_warning_from_any_folder_and_the_robots_drive(
        macro: str, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str], tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with caplog.at_level(logging.WARNING), st.World(f"robots/{macro}.world") as world:
        fleet = world.fleet()
        start = fleet.pose.copy()
        world.run(4)
        moved = np.hypot(*(fleet.pose - start).T[:2])
        assert (moved > 0.005).all() and not fleet.stalled.any(), moved
    # Worlds of other tests may warn when they are unloaded.
    told = [record.getMessage() for record in caplog.records if "was unloaded" not in record.getMessage()]
    assert not told and "warning" not in capfd.readouterr().err


@pytest.mark.parametrize("macro", ROBOTS)
def test_footprint_and_mass(macro: str) -> None:
    with one(macro) as world:
        robot = world.model("r")
        size = numbers(ROBOTS[macro][1])
        assert robot.size == pytest.approx(size) and robot.mass == numbers(ROBOTS[macro][3])[0]
        # Parallel rays from 2 m, 0.5 mm apart, along and across the robot.
        offsets = np.arange(-0.4, 0.4, 0.0005) + 0.00013
        extents = []
        for heading in (math.pi, 0, -math.pi / 2, math.pi / 2):
            back = np.array([math.cos(heading), math.sin(heading)])
            poses = [(*(-2 * back + offset * back[::-1] * (-1, 1)), heading) for offset in offsets]
            ranges = world.cast(np.array(poses), [0.0], 4.0, z=0.03, robots=True)
            extents.append(2 - ranges.min())
        front, rear, left, right = extents
        assert front + rear == pytest.approx(size[0], abs=2e-4)
        assert left == pytest.approx(right, abs=2e-4) and left + right == pytest.approx(size[1], abs=2e-4)
        assert (front - rear) / 2 == pytest.approx(numbers(ROBOTS[macro][2])[0], abs=2e-4)


@pytest.mark.parametrize("macro", ROBOTS)
def test_top_speed_and_ramp(macro: str) -> None:
    with one(macro) as world:
        fleet = world.fleet()
        top, bounds = numbers(ROBOTS[macro][4])[0], re.findall(r"[-\d.]+", ROBOTS[macro][6])
        most = float(bounds[1]) if bounds else math.inf
        fleet.cmd[:] = (100, 0, 0)
        steps = 3 + (0 if math.isinf(most) else math.ceil(top / most / world.dt))
        speeds = []
        for _ in range(steps):
            world.step()
            speeds.append(fleet.velocity[0, 0])
        ramp = [min(top, most * world.dt * (step + 1)) for step in range(steps)]
        lag = steps - len([speed for speed in speeds if speed > 0])
        assert lag <= 1 and speeds[lag:] == pytest.approx(ramp[:steps - lag], rel=1e-9)
        assert speeds[-1] == pytest.approx(top)
        assert world.model("r").pose[0] > 0
        if ROBOTS[macro][5]:
            fleet.cmd[:] = (0, 0, 100)
            world.run(12)
            assert fleet.velocity[0, 2] == pytest.approx(math.radians(numbers(ROBOTS[macro][5])[0]))


@pytest.mark.parametrize("macro", ROBOTS)
def test_sensors(macro: str) -> None:
    with one(macro) as world:
        found = []
        for ranger in world.model("r").children:
            assert {(s.samples, s.range) for s in ranger.sensors} == {(ranger.sensors[0].samples, ranger.sensors[0].range)}
            found.append([len(ranger.sensors), ranger.sensors[0].samples, ranger.sensors[0].range])
            assert 0 < ranger.pose_in_tree[2] < world.model("r").size[2]
        assert found == [pytest.approx(numbers(part)) for part in ROBOTS[macro][7].split(";") if part]


@pytest.mark.parametrize("macro", LIDARS)
def test_lidar_that_sweeps_differs_by_the_time_of_its_rays_alone(macro: str) -> None:
    interval, increment = (numbers(LIDARS[macro][column])[0] for column in (5, 9))
    with st.World.from_text(f'include "robots/lidars.inc"\nposition( name "a" {macro}() )\nposition( name "b" {macro}_sweep() )\n') as world:
        plain, sweeping = (world.model(name).children[0] for name in "ab")
        one, other = plain.sensors[0], sweeping.sensors[0]
        assert (one.range, one.samples, one.fov, one.min_range) == (other.range, other.samples, other.fov, other.min_range)
        assert one.time_increment == 0 and other.time_increment == pytest.approx(increment / 1e6)
        revolution = 2 * math.pi / (other.fov / (other.samples - 1)) * other.time_increment
        assert revolution == pytest.approx(interval / 1e3, rel=0.01)


@pytest.mark.parametrize("macro", LIDARS)
def test_lidar_reads_a_wall(macro: str) -> None:
    nearest, distance, view, rays, interval, share, deviation, step, _ = (numbers(cell)[0] for cell in LIDARS[macro][1:])
    wall = 0.75 * distance
    with st.World.from_text(
            f'include "robots/lidars.inc"\ninterval_sim {interval:g}\nray_model "exact"\n'
            f'position( size [0.2 0.2 0.2] {macro}( pose [0.05 0 -0.05 0] ) )\n'
            f'model( pose [{wall + 0.05 + 0.5} 0 0 0] size [1 {4 * distance} 1] )\n') as world:
        ranger = world.fleet().ranger()
        sensor = world.models[0].children[0].sensors[0]
        assert (sensor.range, sensor.samples) == (distance, rays)
        assert sensor.fov == pytest.approx(math.radians(view))
        bearings = np.linspace(-sensor.fov / 2, sensor.fov / 2, int(rays))
        true = np.full(len(bearings), distance)
        ahead = np.abs(bearings) < math.radians(30)
        true[ahead] = wall / np.cos(bearings[ahead])
        errors = []
        for _ in range(30):
            world.step()
            errors.append(ranger.ranges[0][ahead] - true[ahead])
        assert np.isfinite(errors).all()
        relative = np.array(errors) / true[ahead]
        half = step / 2000 * (1 + 1e-9)  # m, the largest error of rounding
        if share > 0:
            largest = np.abs(relative).max()
            assert 0.97 * share / 100 < largest <= share / 100 + half / true[ahead].min()
        else:
            assert np.std(errors) == pytest.approx(deviation, rel=0.05)
            assert abs(np.mean(errors)) < 6 * deviation / math.sqrt(np.size(errors))
        behind = np.abs(bearings) > math.radians(100)
        assert np.abs(ranger.ranges[0][behind] / distance - 1).max() <= max(share / 100, 6 * deviation / distance) + half
        steps = ranger.ranges[0][ahead] / step * 1000
        assert steps == pytest.approx(np.round(steps), abs=1e-6)


@pytest.mark.parametrize("macro", LIDARS)
def test_lidar_measures_nothing_below_its_minimum(macro: str) -> None:
    nearest, distance = (numbers(cell)[0] for cell in LIDARS[macro][1:3])
    for wall, sees in ((nearest - 0.03, False), (1.3 * nearest, True)):
        with st.World.from_text(
                f'include "robots/lidars.inc"\nresolution 0.005\nray_model "exact"\n'
                f'position( size [0.01 0.01 0.2] {macro}( pose [0 0 -0.05 0] ) )\n'
                f'model( pose [{wall + 0.5} 0 0 0] size [1 2 1] )\n') as world:
            ranger = world.fleet().ranger()
            world.run(1)
            middle = ranger.ranges[0][len(ranger.ranges[0]) // 2]
            assert (middle == distance) != sees, middle
