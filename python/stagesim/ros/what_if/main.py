# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of the node that decides."""

from __future__ import annotations

import argparse
import logging
from typing import Sequence

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, ParameterUninitializedException
from rclpy.utilities import remove_ros_args

from ...errors import StageError
from ...text import printable
from .node import WhatIfNode


def options(argv: Sequence[str]) -> argparse.Namespace:
    """Parses the command line without ROS's own arguments."""
    parser = argparse.ArgumentParser(
        prog="python -m stagesim.ros.what_if", description="Drives a robot to a goal, by simulated futures.",
        epilog="Arguments of ROS follow, such as: --ros-args -p goal:='[4.0, 0.0]' -r __ns:=/r0")
    parser.add_argument("world", nargs="?", help="a world file with the robot (default: the parameter world_file)")
    parser.add_argument("robot", nargs="?", help="its name there (default: the parameter robot)")
    try:
        own = remove_ros_args([printable(word) for word in argv])[1:]
    except RuntimeError as error:
        parser.exit(1, f"stagesim.ros.what_if: {str(error).splitlines()[0]}\n")
    return parser.parse_args(own)


def run(argv: Sequence[str]) -> int | str:
    """Runs the node; returns the argument of sys.exit(): 0, or an error in one line."""
    chosen = options(argv)
    logging.basicConfig(format="%(message)s")  # shows the warnings of worlds
    rclpy.init(args=[printable(word) for word in argv])
    try:
        node = WhatIfNode(chosen.world, chosen.robot)
        try:
            node.run()
        finally:
            node.close()
        return 0
    except (StageError, ValueError, InvalidParameterTypeException, ParameterUninitializedException) as error:
        return f"stagesim.ros.what_if: {error}"
    except KeyboardInterrupt:
        return 0
    except RuntimeError:  # rclpy raises it if a signal has shut it down while the node was working
        if rclpy.ok():
            raise
        return 0
    finally:
        rclpy.try_shutdown()
