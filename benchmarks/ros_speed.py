#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the cost of the ROS 2 node: processor time, and latency from a step to a received scan.

  tools/setup --ros && tools/test -R ros_node       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/ros_speed.py

Worlds run at real time in a separate process, on core 0 alone. A client in this process, on the other cores, subscribes
to nothing, or to the scans and odometry of all robots and to /tf; in the shipped worlds to the true poses, too. The world
"crowd" is generated: 50 robots with 360 rays each and 200 pedestrians. Robots must drive and see something, and pedestrians
must walk. Prints a Markdown table of medians, with minimum and maximum of the repeats in brackets.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage



@dataclass(frozen=True)
class Case:
    """A world, and what the client subscribes to.

    Attributes:
        world: a world file.
        scan: topic of the scans whose latency is measured.
        robots: number of robots r0, r1 and so on with such a topic.
        odometry: their topics of odometry.
        people: number of robots p0, p1 and so on, of which only the frames are received.
        parameters: parameters of the node.
    """

    world: str
    scan: str
    robots: int
    odometry: tuple[str, ...] = ("odom", "ground_truth")
    people: int = 0
    parameters: dict[str, Any] = field(default_factory=dict)


SHIPPED = (
    Case("hospital.world", "base_scan", 100),
    Case("cave.world", "base_scan1", 100, parameters={"single_beams": "none"}),
)
CROWD = """
name "crowd"
resolution 0.05
interval_sim 100
threads 1
define wall model( size [0.2 0.2 2] color "gray40" )
define pillar model( size [0.6 0.6 2] color "gray40" )
define bot position( size [0.5 0.5 0.5] round 1 drive "diff" ctrl "stage/wander speed=0.5" color "blue"
  ranger( pose [0 0 -0.2 0] sensor( range [0.05 10] fov 360 samples 360 ) ) )
define person position( size [0.4 0.4 1.7] round 1 drive "omni" color "red" stack_children 0
  velocity_bounds [-3 3 -3 3 0 0 -180 180]
  ranger( pose [0 0 0.3 0] sensor( range [0 2] fov 360 samples 36 ) ) )
"""
SIDE, APART = 40.0, 2.2  # metres: side of the hall, and distance of places at the start


def crowd(robots: int = 50, people: int = 200) -> str:
    """A world with robots that wander and pedestrians who walk by social forces in a hall with pillars."""
    draw = np.random.default_rng(1)
    lines, half = [CROWD], SIDE / 2
    for x, y, wide, high in ((0, half, SIDE, 0.2), (0, -half, SIDE, 0.2), (half, 0, 0.2, SIDE), (-half, 0, 0.2, SIDE)):
        lines.append(f"wall( pose [{x} {y} 0 0] size [{wide} {high} 2] )")
    row = np.arange(-half + APART, half - 1, APART)
    places = draw.permutation([(x, y) for x in row for y in row])
    angles = draw.uniform(-180, 180, len(places))
    for number in range(robots + people + 12):
        pose = f"pose [{places[number][0]:.3f} {places[number][1]:.3f} 0 {angles[number]:.1f}]"
        if number < robots:
            lines.append(f'bot( name "r{number}" {pose} )')
        elif number < robots + people:
            goals = ",".join(f"{value:.2f}" for value in draw.uniform(-half + 1.5, half - 1.5, 8))
            speed = np.clip(draw.normal(1.34, 0.26), 0.6, 2)  # as in docs/people.md
            lines.append(f'person( name "p{number - robots}" {pose} ctrl "stage/pedestrian goals={goals} loop=1 near=1 '
                         f'speed={speed:.2f} radius=0.2 repulsion=7 reach=0.4 tolerance=0.3" )')
        else:
            lines.append(f"pillar( {pose} )")
    return "\n".join(lines)


class Listener:
    """Receives messages as bytes and notes their arrival, without processing them.

    It polls once per millisecond. An executor of rclpy would take longer to deliver messages than the node
    takes to send them, or would not give the time of publication.

    Attributes:
        scans: of each scan: its stamp, nanoseconds of simulated time; when it was published and when it was
            here, nanoseconds of real time.
        others: how many other messages there were.
        ends: the first and the last message of each topic.
    """

    def __init__(self, case: Case) -> None:
        self.scans: list[tuple[int, int, int]] = []
        self.others = 0
        self.ends: dict[str, tuple[bytes, bytes]] = {}
        self._kinds: dict[str, type] = {}
        self._node = Node("listener")
        names = [f"/r{robot}" for robot in range(case.robots)]
        self._scans = [self._listen(LaserScan, f"{name}/{case.scan}", qos_profile_sensor_data) for name in names]
        self._others = [self._listen(Odometry, f"{name}/{topic}", 10) for name in names for topic in case.odometry]
        self._others.append(self._listen(TFMessage, "/tf", 100))

    def _listen(self, kind: type, topic: str, qos: Any) -> tuple[Any, type, str]:
        self._kinds[topic] = kind
        return self._node.create_subscription(kind, topic, lambda _: None, qos, raw=True).handle, kind, topic

    def messages(self, topic: str) -> tuple[Any, Any]:
        """The first and the last message of a topic."""
        first, last = self.ends[topic]
        return deserialize_message(first, self._kinds[topic]), deserialize_message(last, self._kinds[topic])

    def _keep(self, topic: str, message: bytes) -> None:
        self.ends[topic] = self.ends.get(topic, (message,))[0], message

    def listen_until_end(self, process: subprocess.Popen[str]) -> None:
        while process.poll() is None:
            for subscription, kind, topic in self._scans:
                while (taken := subscription.take_message(kind, True)) is not None:
                    self._keep(topic, taken[0])
                    seconds, nanoseconds = np.frombuffer(taken[0], np.uint32, 2, 4)
                    self.scans.append((int(seconds) * 10**9 + int(nanoseconds),
                                       taken[1]["source_timestamp"], time.time_ns()))
            for subscription, kind, topic in self._others:
                while (taken := subscription.take_message(kind, True)) is not None:
                    self._keep(topic, taken[0])
                    self.others += 1
            time.sleep(0.001)

    def close(self) -> None:
        self._node.destroy_node()

    def latencies(self) -> list[float]:
        """Milliseconds from the publication of a step's first scan to the arrival of each of its
        scans."""
        first: dict[int, int] = {}
        for stamp, published, _ in self.scans:
            first[stamp] = min(published, first.get(stamp, published))
        return [(here - first[stamp]) / 1e6 for stamp, _, here in self.scans]


def check(case: Case, heard: Listener, seconds: float) -> None:
    """Asserts that most robots have driven and seen something, and that most pedestrians have walked.

    Robots drive at 0.4 m/s or more and turn often, pedestrians walk at 0.6 m/s or more around each other.
    """
    seen = [np.isfinite(heard.messages(f"/r{robot}/{case.scan}")[1].ranges).mean() for robot in range(case.robots)]
    assert np.median(seen) > 0.3, f"robots see little: {np.median(seen)}"
    ways = dict(zip("rp", ([], [])))
    first, last = ({each.child_frame_id: each.transform.translation for each in message.transforms}
                   for message in heard.messages("/tf"))
    for name in first.keys() & last.keys():
        way = np.hypot(last[name].x - first[name].x, last[name].y - first[name].y)
        ways[name[0]].append(way)
    assert len(ways["r"]) == case.robots and len(ways["p"]) == case.people, {who: len(way) for who, way in ways.items()}
    for way in ways.values():
        assert not way or np.median(way) > min(1.0, 0.05 * seconds), f"few have moved: {np.median(way)}"


def run(case: Case, seconds: float, listens: bool) -> dict[str, float]:
    """Returns the figures of a run."""
    command = ["taskset", "-c", "0", sys.executable, "-m", "stagesim.ros", case.world, "--duration", str(seconds), "--stats",
               "--ros-args"]
    for name, value in case.parameters.items():
        command += ["-p", f"{name}:={value}"]
    listener = Listener(case) if listens else None
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        if listener:
            listener.listen_until_end(process)
        figures: dict[str, float] = json.loads(process.communicate()[0])
    real = figures["real"]
    shares = {part: 100 * figures[part] / real for part in ("step", "publish", "answer", "process")}
    found = {**shares, "speed": figures["simulated"] / real}
    if listener:
        late = listener.latencies()
        found.update(messages=(len(late) + listener.others) / real, scans=100 * len(late) / (
            case.robots * figures["steps"]), median=statistics.median(late),
            most=float(np.quantile(late, 0.99)))
        check(case, listener, seconds)
        listener.close()
    return found


def span(values: list[float]) -> str:
    """Formats median, minimum and maximum."""
    return f"{statistics.median(values):.4g} ({min(values):.4g} to {max(values):.4g})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20, help="seconds per run")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--crowd", action="store_true", help="only the world of robots and pedestrians")
    chosen = parser.parse_args()
    if len(os.sched_getaffinity(0)) > 1:
        os.sched_setaffinity(0, os.sched_getaffinity(0) - {0})
    rclpy.init()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "crowd.world"
        file.write_text(crowd())
        people = Case(str(file), "base_scan", 50, ("odom",), 200)
        measure([people] if chosen.crowd else [*SHIPPED, people], chosen.repeats, chosen.seconds)
    rclpy.try_shutdown()


def measure(cases: list[Case], repeats: int, seconds: float) -> None:
    """Runs the cases in turn and prints the table."""
    columns = {"speed": "speed", "step": "steps, %", "publish": "publishing, %", "answer": "answering, %",
               "process": "whole process, % of a core", "messages": "messages/s", "scans": "scans received, %",
               "median": "step to scan, ms", "most": "99th percentile, ms"}
    print("| world | listeners |", " | ".join(columns.values()), "| load |")
    print("|" + "---|" * (3 + len(columns)))
    rows = [(case, listens) for case in cases for listens in (False, True)]
    found: list[list[dict[str, float]]] = [[] for _ in rows]
    loads: list[list[float]] = [[] for _ in rows]
    for _ in range(repeats):
        for i, (case, listens) in enumerate(rows):
            found[i].append(run(case, seconds, listens))
            loads[i].append(os.getloadavg()[0])
    for i, (case, listens) in enumerate(rows):
        cells = [span([figures[key] for figures in found[i]]) if key in found[i][0] else "" for key in columns]
        print(f"| {Path(case.world).stem} | {'all' if listens else 'none'} |", " | ".join([*cells, span(loads[i])]), "|")


if __name__ == "__main__":
    main()
