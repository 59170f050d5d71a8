# SPDX-License-Identifier: GPL-2.0-or-later
"""The node's command line."""

from __future__ import annotations

import argparse
import json
import logging
import time
from typing import Sequence

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, ParameterUninitializedException
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from .. import _options
from ..errors import StageError, WorldError
from ..text import printable
from ..world import World
from .node import StageNode


def options(argv: Sequence[str]) -> argparse.Namespace:
    """Parses the command line without ROS's own arguments."""
    parser = argparse.ArgumentParser(
        prog="python -m stagesim.ros", description="Simulates a world and connects its robots to ROS 2.",
        epilog="Arguments of ROS follow, such as: --ros-args -p naming:=stage_ros -p speed:=2.0")
    parser.add_argument("world", nargs="?", help="a world file, or the name of a shipped world "
                        "(default: the parameter world_file)")
    _options.add_to(parser)
    parser.add_argument("--duration", type=float, default=float("inf"), metavar="SECONDS",
                        help="simulated time after which the node ends (default: it never ends)")
    parser.add_argument("--map", metavar="FILE", help="instead of a world: a map.yaml, or another file of stage import")
    parser.add_argument("--robot", action="append", default=[], metavar="MACRO:X,Y,DEGREES",
                        help="with --map: a robot of the folder robots, such as turtlebot3_burger:1,2,90; may be given "
                             "several times")
    parser.add_argument("--stats", action="store_true", help="at the end, print how long each part took, as JSON")
    parser.add_argument("--gui", type=_port_of, nargs="?", const=0, metavar="PORT",
                        help="show the world in a page for browsers on this machine: --gui=PORT, or --gui for any "
                             "free port")
    given = {printable(word): word for word in argv}  # ROS accepts only valid Unicode
    try:
        own = [given.get(word, word) for word in remove_ros_args([printable(word) for word in argv])[1:]]
    except RuntimeError as error:
        parser.exit(1, f"stagesim.ros: {str(error).splitlines()[0]}\n")
    if "--gui" in own:
        from ..live.command_line import with_port

        own = with_port(own, "--gui", 0)
    return parser.parse_args(_options.unambiguous(own))


def _port_of(text: str) -> int:
    from ..live.command_line import port_of

    return port_of(text)


def world_file(given: str | None) -> str:
    """The world file from the command line, or else from the parameter `world_file`; may be empty."""
    if given:
        return given
    # The real node can't be made without the world, so a temporary node reads the parameter.
    asker = Node("stage", start_parameter_services=False, enable_rosout=False)
    try:
        return str(asker.declare_parameter("world_file", "").value)
    finally:
        asker.destroy_node()


def statistics(node: StageNode, seconds: float) -> str:
    """Statistics of a run as JSON; `seconds` is its duration in real time."""
    world = node.world
    return json.dumps({"robots": len(node.robots), "steps": world.steps, "simulated": world.time,
                       "real": seconds, "state": world.state_hash(), **node.times})


def run(argv: Sequence[str]) -> int | str:
    """Runs the node; returns the argument of sys.exit(): 0, or an error in one line."""
    chosen = options(argv)
    logging.basicConfig(format="%(message)s")  # shows the warnings of worlds
    rclpy.init(args=[printable(word) for word in argv])
    try:
        return _run(chosen)
    except (WorldError, StageError, ValueError, OSError, ModuleNotFoundError, InvalidParameterTypeException,
            ParameterUninitializedException) as error:
        return f"stagesim.ros: {error}"
    except KeyboardInterrupt:
        return 0
    except RuntimeError:  # rclpy raises it if a signal has shut it down while the node was working
        if rclpy.ok():
            raise
        return 0
    finally:
        rclpy.try_shutdown()


def _world_of(chosen: argparse.Namespace) -> tuple[str, World]:
    """The world that the command line asks for, and its file. Raises ValueError, StageError or OSError."""
    options = _options.given_in(chosen)
    if chosen.map is None:
        if chosen.robot:
            raise ValueError("found --robot without --map, expected both")
        file = world_file(chosen.world)
        if not file:
            raise ValueError("found no world, expected one on the command line or in the parameter world_file, or --map")
        return file, World(file, **options)
    if chosen.world or not chosen.robot:
        raise ValueError(f"found --map {'and a world' if chosen.world else 'without --robot'}, expected --map with --robot")
    from ..maps import MapScene, read_map, robot_of

    robots = [robot_of(text) for text in chosen.robot]
    return chosen.map, World.of(MapScene.of(read_map(chosen.map), robots), **options)


def _run(chosen: argparse.Namespace) -> int | str:
    file, world = _world_of(chosen)
    with world:
        node = StageNode(world, gui=chosen.gui)
        node.get_logger().info(f"{printable(file)}: {len(node.robots)} robots, {node.topics} topics")
        try:
            if node.url:
                from ..live.command_line import open_page

                open_page(node.url)
            start = time.perf_counter()
            node.run(chosen.duration)
            if chosen.stats:
                print(statistics(node, time.perf_counter() - start), flush=True)
        finally:
            node.close()
    return 0
