# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of the node that decides."""

from __future__ import annotations

import argparse
import logging
import signal
from typing import Sequence

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, ParameterUninitializedException
from rclpy.signals import SignalHandlerOptions
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
    # ROS would shut down at once, and the robot would get no command to stop any more.
    rclpy.init(args=[printable(word) for word in argv], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = WhatIfNode(chosen.world, chosen.robot)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: node.end())
        try:
            node.run()
        finally:
            node.close()
        return 0
    except (StageError, ValueError, InvalidParameterTypeException, ParameterUninitializedException) as error:
        return f"stagesim.ros.what_if: {error}"
    except KeyboardInterrupt:  # before the node was there
        return 0
    finally:
        rclpy.try_shutdown()
