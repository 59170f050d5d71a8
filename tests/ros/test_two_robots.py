# SPDX-License-Identifier: GPL-2.0-or-later
"""Two robots in one process and in two: the runs are equal, and equal to that without ROS."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Callable

import numpy as np
import pytest
import stagesim as st
from patience import PATIENCE
from ros_testing import Client, Process
from sensor_msgs.msg import LaserScan

pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros")

import wander  # noqa: E402  (from examples/ros)

SECONDS = 5
# The robots meet in the middle of a pen; their scans see each other.
WORLD = """
resolution 0.02
model( pose [0 2 0 0] size [4 0.1 1] )
model( pose [0 -2 0 0] size [4 0.1 1] )
define bot position( size [0.4 0.4 0.4] localization "odom" odom_error [0.02 0.01 0.03 0.02]
  ranger( pose [0 0 -0.2 0] sensor( range [0 3] fov 180 samples 60 ) ) )
bot( name "r0" pose [-1.5 0.1 0 0] )
bot( name "r1" pose [1.5 0 0 180] )
"""


@pytest.fixture
def pen(tmp_path: Path) -> str:
    file = tmp_path / "pen.world"
    file.write_text(WORLD)
    return str(file)


def without_ros(pen: str) -> tuple[str, float]:
    """Runs the same controllers from the first step on; returns the state hash, and the robots' least distance."""
    least = np.inf
    with st.World(pen) as world:
        fleet = world.fleet()
        cmd, ranges, estimate = fleet.cmd, fleet.ranger().ranges, fleet.estimate
        cmd[:] = np.nan
        for model in world.models:  # subscribes after the sensors, because the order is part of the state
            if model.type == "position" and model.subscribers == 0:
                model.subscribe()
        before = estimate.copy()  # a scan is of the beginning of a step
        while world.time < SECONDS:
            if world.steps > 0:
                for robot, row in enumerate(ranges.astype(np.float32)):
                    ahead, turn = wander.velocity(row, before[robot])
                    cmd[robot] = ahead, 0, turn
            before = fleet.estimate.copy()
            world.step()
            least = min(least, float(np.hypot(*(fleet.pose[0] - fleet.pose[1])[:2])))
        return world.state_hash(), least


@pytest.mark.parametrize("namespaced", (True, False))
def test_one_process_and_two_make_the_run_without_ros(start: Callable[..., Process], client: Client, pen: str,
                                                      namespaced: bool) -> None:
    def run() -> Process:
        return start(pen, "--duration", str(SECONDS), "--stats", stamped_cmd_vel=True, lockstep="all", speed=0,
                     **({"namespaced_tf": "only"} if namespaced else {}))

    expected, least = without_ros(pen)
    assert least < 1  # they have met
    # One node for both robots, in this process.
    node = client.serve(wander.Wander(["r0", "r1"], namespaced_tf=namespaced))
    scans = client.listen(LaserScan, "/r0/base_scan")
    stage = run()
    client.until(lambda: stage.process.poll() is not None)
    assert stage.statistics()["state"] == expected
    assert scans[0].ranges[30] == pytest.approx(2.8, abs=0.1)  # the front of the other robot
    assert min(robot.scans for robot in node.robots) >= 10 * SECONDS - 1
    if not namespaced:
        return
    # A process for each robot.
    client.drop(node)
    others = [subprocess.Popen([sys.executable, wander.__file__, name, "--ros-args", "-p", "namespaced_tf:=true"])
              for name in ("r0", "r1")]
    try:
        assert run().statistics()["state"] == expected
    finally:
        for other in others:
            other.terminate()
            other.wait(PATIENCE)
