#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares stagesim and IR-SIM (pypi.org/project/ir-sim) in agent-steps per second, in alternating runs.

  python3 -m venv /tmp/irsim && /tmp/irsim/bin/pip install ir-sim
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/against_ir_sim.py --ir-sim /tmp/irsim/bin/python

Round robots of 0.2 m radius with differential drives drive in circles in a room of 20 m. Each has a lidar of 100 rays,
12 m and 180 degrees. Steps take 0.1 s. Both simulators use one thread and measure ranges to outlines (`ray_model
"exact"` here). Before the measurement, the first scans of all robots are compared ray by ray. The benchmark fails
unless the median difference is at most 2 cm and most rays hit something.

Prints a Markdown table of median, minimum and maximum of the repeats, and the ratio of consecutive
runs.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROBOTS = (1, 10, 50)
RADIUS, REACH, RAYS, SIDE = 0.2, 12.0, 100, 20.0
SPEED, TURN = 0.4, 1.2  # m/s and rad/s; robots drive in circles of a third of a metre and never meet


def places(robots: int) -> list[tuple[float, float, float]]:
    """Start poses on a square lattice: x and y in metres from a corner of the room, heading in radians."""
    rows = math.ceil(math.sqrt(robots))
    pitch = SIDE / (rows + 1)
    return [(pitch * (1 + i % rows), pitch * (1 + i // rows), 0.7 * i % math.tau - math.pi) for i in range(robots)]


def stage_world(robots: int) -> str:
    """The scene as a world file."""
    corners = " ".join(f"point[{i}] [{1 + math.cos(math.tau * i / 16):.5f} {1 + math.sin(math.tau * i / 16):.5f}]"
                       for i in range(16))
    walls = "\n".join(f"model( pose [{x} {y} 0 0] size [{w} {h} 1] )" for x, y, w, h in walls_of_the_room())
    bots = "\n".join(f"bot( pose [{x:.6f} {y:.6f} 0 {math.degrees(a):.6f}] )" for x, y, a in places(robots))
    return f"""resolution 0.02 interval_sim 100 quit_time 0 ray_model "exact"
define lidar ranger( size [0.02 0.02 0.1] pose [0 0 -0.2 0] sensor( range [0 {REACH}] fov 180 samples {RAYS} ) )
define bot position( size [{2 * RADIUS} {2 * RADIUS} 0.4] drive "diff" block( points 16 {corners} ) lidar() )
{walls}
{bots}
"""


def walls_of_the_room() -> list[tuple[float, float, float, float]]:
    """Centre and size of each wall, metres."""
    half = SIDE / 2
    return [(half, 0, SIDE, 0.2), (half, SIDE, SIDE, 0.2), (0, half, 0.2, SIDE), (SIDE, half, 0.2, SIDE)]


def ir_sim_world(robots: int) -> str:
    """The scene as IR-SIM's YAML."""
    bots = "".join(
        f"  - {{kinematics: {{name: diff}}, shape: {{name: circle, radius: {RADIUS}}}, state: [{x:.6f}, {y:.6f}, {a:.6f}],\n"
        f"     vel_max: [2, 3], sensors: [{{name: lidar2d, range_min: 0, range_max: {REACH}, angle_range: {math.pi},\n"
        f"     number: {RAYS}, noise: False}}]}}\n" for x, y, a in places(robots))
    walls = "".join(f"  - {{shape: {{name: rectangle, length: {w}, width: {h}}}, state: [{x}, {y}, 0]}}\n"
                    for x, y, w, h in walls_of_the_room())
    return (f"world: {{height: {SIDE}, width: {SIDE}, step_time: 0.1, sample_time: 0.1, collision_mode: stop}}\n"
            f"robot:\n{bots}obstacle:\n{walls}")


def agent_steps_a_second(step, robots: int, seconds: float) -> float:
    """Returns agent-steps per second, measured over `seconds`."""
    count, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        step()
        count += 1
    return count * robots / (time.perf_counter() - start)


def measure_stage(robots: int, seconds: float) -> tuple[float, list]:
    """Returns the speed of stagesim and the first scans."""
    import stagesim as st

    world = st.World.from_text(stage_world(robots), threads=1)
    fleet = world.fleet()
    ranges = fleet.ranger().ranges
    fleet.cmd[:, 0], fleet.cmd[:, 2] = SPEED, TURN
    world.step()
    scans = ranges.tolist()
    before = fleet.pose.copy()
    rate = agent_steps_a_second(world.step, robots, seconds)
    world.step(3)
    assert (abs(fleet.pose - before).max(axis=1) > 1e-3).all(), "found a robot that has not moved"
    return rate, scans


def measure_ir_sim(robots: int, seconds: float) -> tuple[float, list]:
    """Returns the speed of IR-SIM and the first scans."""
    import irsim
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "room.yaml"
        file.write_text(ir_sim_world(robots))
        env = irsim.make(str(file), display=False, log_level="ERROR")
    ids = list(range(robots))
    scans = [np.asarray(env.get_lidar_scan(i)["ranges"], dtype=float).tolist() for i in ids]
    commands = [np.array([[SPEED], [TURN]]) for _ in ids]
    before = [robot.state.copy() for robot in env.robot_list]
    rate = agent_steps_a_second(lambda: env.step(commands, ids), robots, seconds)
    env.step(commands, ids)
    moved = [float(abs(robot.state - start).max()) for robot, start in zip(env.robot_list, before)]
    assert min(moved) > 1e-3, "found a robot that has not moved"
    return rate, scans


def compare(first: list, second: list) -> None:
    """Ends the program unless the readings of both simulators agree."""
    mine, theirs = sum(first, []), sum(second, [])
    apart = [abs(a - b) for a, b in zip(mine, theirs)]
    hits = [sum(r < REACH - 1e-3 for r in scan) / len(scan) for scan in (mine, theirs)]
    if len(mine) != len(theirs) or statistics.median(apart) > 0.02 or min(hits) < 0.5:
        sys.exit(f"against_ir_sim.py: found {len(mine)} and {len(theirs)} readings with a median "
                 f"difference of {statistics.median(apart):.3f} m, of which {min(hits):.0%} hit "
                 "something; expected the same scene")


def run(python: str, simulator: str, robots: int, seconds: float) -> dict:
    """Runs one simulator in a separate process."""
    command = [python, __file__, "--measure", simulator, "--robots", str(robots), "--seconds", str(seconds)]
    output = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    return json.loads(output.splitlines()[-1])


def show(values: list[float]) -> str:
    return f"{statistics.median(values):,.0f} ({min(values):,.0f} to {max(values):,.0f})".replace(",", " ")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ir-sim", default=sys.executable, metavar="PYTHON",
                        help="a Python interpreter with IR-SIM")
    parser.add_argument("--seconds", type=float, default=3,
                        help="seconds per run (default %(default)s)")
    parser.add_argument("--repeats", type=int, default=3, help="(default %(default)s)")
    parser.add_argument("--measure", choices=("stage", "ir-sim"), help=argparse.SUPPRESS)
    parser.add_argument("--robots", type=int, default=1, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.measure:
        measure = measure_stage if chosen.measure == "stage" else measure_ir_sim
        rate, scans = measure(chosen.robots, chosen.seconds)
        print(json.dumps({"rate": rate, "scans": scans}))
        return
    print("| robots | stagesim | IR-SIM | ratio |\n|---|---|---|---|")
    for robots in ROBOTS:
        stage, ir_sim = [], []
        for _ in range(chosen.repeats):
            mine = run(sys.executable, "stage", robots, chosen.seconds)
            theirs = run(chosen.ir_sim, "ir-sim", robots, chosen.seconds)
            compare(mine["scans"], theirs["scans"])
            stage.append(mine["rate"])
            ir_sim.append(theirs["rate"])
        ratio = statistics.median(a / b for a, b in zip(stage, ir_sim))
        print(f"| {robots} | {show(stage)} | {show(ir_sim)} | {ratio:.0f} |", flush=True)


if __name__ == "__main__":
    main()
