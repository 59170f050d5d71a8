#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the cost of the ROS 2 node: processor time, and latency from a step to a received scan.

  tools/setup --ros && tools/test -R ros_node       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/ros_speed.py

Worlds run at real time in a separate process. A client in this process subscribes to nothing, or to the
scans, odometry and true poses of all robots and to /tf. Prints a Markdown table of medians, with minimum and
maximum of the repeats in brackets.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import time
from typing import Any

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

# World, parameters, and topic of the scans whose latency is measured.
CASES = (
    ("hospital.world", {}, "base_scan"),
    ("cave.world", {"single_beams": "none"}, "base_scan1"),
)
ROBOTS = 100


class Listener:
    """Receives messages as bytes and notes their arrival, without processing them.

    It polls once per millisecond. An executor of rclpy would take longer to deliver messages than the node
    takes to send them, or would not give the time of publication.

    Attributes:
        scans: of each scan: its stamp, nanoseconds of simulated time; when it was published and when it was
            here, nanoseconds of real time.
        others: how many other messages there were.
    """

    def __init__(self, scan: str) -> None:
        self.scans: list[tuple[int, int, int]] = []
        self.others = 0
        self._node = Node("listener")
        names = [f"/r{robot}" for robot in range(ROBOTS)]
        self._scans = [self._listen(LaserScan, f"{name}/{scan}", qos_profile_sensor_data) for name in names]
        self._others = [self._listen(Odometry, f"{name}/{topic}", 10) for name in names
                        for topic in ("odom", "ground_truth")]
        self._others.append(self._listen(TFMessage, "/tf", 100))

    def _listen(self, kind: type, topic: str, qos: Any) -> tuple[Any, type]:
        return self._node.create_subscription(kind, topic, lambda _: None, qos, raw=True).handle, kind

    def listen_until_end(self, process: subprocess.Popen[str]) -> None:
        while process.poll() is None:
            for subscription, kind in self._scans:
                while (taken := subscription.take_message(kind, True)) is not None:
                    seconds, nanoseconds = np.frombuffer(taken[0], np.uint32, 2, 4)
                    self.scans.append((int(seconds) * 10**9 + int(nanoseconds),
                                       taken[1]["source_timestamp"], time.time_ns()))
            for subscription, kind in self._others:
                while subscription.take_message(kind, True) is not None:
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


def run(world: str, parameters: dict[str, Any], scan: str, seconds: float, listens: bool) -> dict[str, float]:
    """Returns the figures of a run."""
    command = [sys.executable, "-m", "stagesim.ros", world, "--duration", str(seconds), "--stats", "--ros-args"]
    for name, value in parameters.items():
        command += ["-p", f"{name}:={value}"]
    listener = Listener(scan) if listens else None
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        if listener:
            listener.listen_until_end(process)
        figures: dict[str, float] = json.loads(process.communicate()[0])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    real = figures["real"]
    shares = {part: 100 * figures[part] / real for part in ("step", "publish", "answer")}
    # Includes the threads of DDS and start-up.
    shares["process"] = 100 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / real
    found = {**shares, "speed": figures["simulated"] / real}
    if listener:
        late = listener.latencies()
        found.update(messages=(len(late) + listener.others) / real, scans=100 * len(late) / (
            ROBOTS * figures["steps"]), median=statistics.median(late),
            most=float(np.quantile(late, 0.99)))
        listener.close()
    return found


def span(values: list[float]) -> str:
    """Formats median, minimum and maximum."""
    return f"{statistics.median(values):.4g} ({min(values):.4g} to {max(values):.4g})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20, help="seconds per run")
    parser.add_argument("--repeats", type=int, default=5)
    chosen = parser.parse_args()
    rclpy.init()
    columns = {"speed": "speed", "step": "steps, %", "publish": "publishing, %", "answer": "answering, %",
               "process": "whole process, % of a core", "messages": "messages/s", "scans": "scans received, %",
               "median": "step to scan, ms", "most": "99th percentile, ms"}
    print("| world | listeners |", " | ".join(columns.values()), "|")
    print("|" + "---|" * (2 + len(columns)))
    cases = [(*case, listens) for case in CASES for listens in (False, True)]
    found: dict[int, list[dict[str, float]]] = {}
    for _ in range(chosen.repeats):
        for i, (world, parameters, scan, listens) in enumerate(cases):
            found.setdefault(i, []).append(run(world, parameters, scan, chosen.seconds, listens))
    for i, (world, _, _, listens) in enumerate(cases):
        row = [span([figures[key] for figures in found[i]]) if key in found[i][0] else ""
               for key in columns]
        print(f"| {world} | {'all' if listens else 'none'} |", " | ".join(row), "|")
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
