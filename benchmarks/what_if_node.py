#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the ROS 2 node that decides: the time from a measurement to the command that answers it.

  tools/setup --ros && tools/test -R ros_node       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/what_if_node.py

A simulation runs at real time in one process, and the node in another one: ten times a second it decides among 34 plans of
10 samples each, 5 s ahead, with five others that drive in circles. This process listens. The time is from the publication
of the odometry to that of the command with the same stamp, by the clock of the machine. Prints the figures as JSON,
and fails if less work was done than asked: each step has a command, and each plan all samples.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

import numpy as np
import rclpy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from visualization_msgs.msg import MarkerArray

OTHERS, SAMPLES, PLANS, RATE = 5, 10, 34, 10
WARM = 4  #: seconds that don't count, in which processes find each other
ROBOT = 'size [0.4 0.4 0.4] round 1 drive "diff" localization "gps" )\n'
ALONE = f'resolution 0.05\ninterval_sim {1000 // RATE}\nposition( name "robot" {ROBOT}'


class Listener:
    """Receives messages and notes when they were published, nanoseconds of real time.

    Attributes:
        measured, commands: times by the stamps of odometry and commands.
        tables: the tables of scores.
    """

    def __init__(self, futures: bool) -> None:
        self.measured: dict[bytes, int] = {}
        self.commands: dict[bytes, int] = {}
        self.tables: list[np.ndarray] = []
        self.node = Node("listener")
        self._odometry = self._listen(Odometry, "/robot/ground_truth")
        self._commands = self._listen(TwistStamped, "/robot/cmd_vel")
        self._scores = self._listen(Float64MultiArray, "/robot/what_if/scores")
        self._futures = self._listen(MarkerArray, "/robot/what_if/futures") if futures else None
        self._circles = [self.node.create_publisher(TwistStamped, f"/other{i}/cmd_vel", 10) for i in range(OTHERS)]

    def _listen(self, kind: type, topic: str) -> Any:
        return self.node.create_subscription(kind, topic, lambda _: None, 1000, raw=True).handle

    def take(self) -> None:
        """Takes all messages that have arrived."""
        for handle, kind, times in ((self._odometry, Odometry, self.measured), (self._commands, TwistStamped, self.commands)):
            while (taken := handle.take_message(kind, True)) is not None:
                times.setdefault(bytes(taken[0][4:12]), taken[1]["source_timestamp"])
        while (taken := self._scores.take_message(Float64MultiArray, False)) is not None:
            self.tables.append(np.reshape(taken[0].data, [each.size for each in taken[0].layout.dim]))
        while self._futures is not None and self._futures.take_message(MarkerArray, True) is not None:
            pass

    def drive_others(self) -> None:
        """Lets the others drive in circles; they go on without further commands."""
        message = TwistStamped()
        message.twist.linear.x, message.twist.angular.z = 0.4, 0.3
        for publisher in self._circles:
            publisher.publish(message)


def processes(folder: Path, seconds: float, samples: int) -> list[list[str]]:
    """The commands of the node and of the simulation."""
    (folder / "robot.world").write_text(ALONE)
    others = "".join(f'position( name "other{i}" pose [{2 + i} {3 * (-1) ** i} 0 0] {ROBOT}' for i in range(OTHERS))
    (folder / "all.world").write_text(ALONE + others)
    common = [sys.executable, "-m"]
    topics = ",".join(f"/other{i}/ground_truth" for i in range(OTHERS))
    decides = [*common, "stagesim.ros.what_if", str(folder / "robot.world"), "--ros-args", "-r", "__ns:=/robot", "-r",
               "odom:=ground_truth"]
    for name, value in {"localization": "odom", "map_topic": '""', "others": topics, "goal": "[1000.0, 0.0]",
                        "use_sim_time": "true", "stamped_cmd_vel": "true", "samples": samples}.items():
        decides += ["-p", f"{name}:={value}"]
    simulates = [*common, "stagesim.ros", str(folder / "all.world"), "--duration", str(seconds), "--ros-args", "-p",
                 "stamped_cmd_vel:=true", "-p", "base_watchdog_timeout:=0.0"]
    return [decides, simulates]


def run(seconds: float, samples: int, futures: bool) -> dict[str, Any]:
    """Returns the figures of a run, whose first seconds don't count."""
    listener = Listener(futures)
    with tempfile.TemporaryDirectory() as folder:
        decides, simulates = processes(Path(folder), seconds + WARM, samples)
        with subprocess.Popen(decides, stderr=subprocess.PIPE, text=True) as node, \
                subprocess.Popen(simulates, stderr=subprocess.DEVNULL) as simulation:
            began = time.monotonic()
            while simulation.poll() is None:
                listener.take()
                if time.monotonic() - began < WARM:
                    listener.drive_others()
                time.sleep(0.001)
            node.terminate()
            log = node.communicate()[1]
    warm = [stamp for stamp in listener.measured if np.frombuffer(stamp, np.uint32)[0] >= WARM]
    late = [(listener.commands[stamp] - listener.measured[stamp]) / 1e6 for stamp in warm if stamp in listener.commands]
    stops = [line.split("]: ")[1] for line in log.splitlines() if "stopped: " in line and "has been received" not in line]
    complete = sum(table.shape[0] == PLANS and bool((table[:, 7] >= samples).all()) for table in listener.tables)
    listener.node.destroy_node()
    return {"steps": len(warm), "commands": len(late), "complete_decisions": complete, "stops": stops,
            "median_ms": round(float(np.median(late)), 2), "99_percent_ms": round(float(np.quantile(late, 0.99)), 2),
            "most_ms": round(max(late), 2), "load": round(os.getloadavg()[0], 1)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--futures", action="store_true", help="listen to the futures, too")
    chosen = parser.parse_args()
    rclpy.init()
    found = run(chosen.seconds, chosen.samples, chosen.futures)
    print(json.dumps(found))
    rclpy.try_shutdown()
    wanted = 0.95 * chosen.seconds * RATE
    if found["commands"] < wanted or found["complete_decisions"] < wanted:
        sys.exit(f"found too few commands or complete decisions, expected {wanted:.0f}")


if __name__ == "__main__":
    main()
