# SPDX-License-Identifier: GPL-2.0-or-later
"""The node's command line."""

from __future__ import annotations

import argparse
import json
import logging
import signal
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
from .lifecycle import LifecycleStageNode
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
    parser.add_argument("--lifecycle", action="store_true", help="start a lifecycle node without a world, which the "
                        "transition configure loads and the transition activate runs")
    parser.add_argument("--log", metavar="FILE", help="an MCAP file in which the run is recorded (default: the parameter "
                        "log_file, or none)")
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


def run_measured(node: StageNode, duration: float) -> str:
    """Runs a node; returns statistics as JSON: times in seconds, "process" for all threads."""
    real, process = time.perf_counter(), time.process_time()
    node.run(duration)
    real, process = time.perf_counter() - real, time.process_time() - process
    if not hasattr(node, "world"):  # of a lifecycle node
        return json.dumps({"robots": 0, "real": real, "process": process, **node.times})
    world = node.world
    return json.dumps({"robots": len(node.robots), "steps": world.steps, "simulated": world.time, "real": real,
                       "process": process, "state": world.state_hash(), **node.times})


def run(argv: Sequence[str]) -> int | str:
    """Runs the node; returns the argument of sys.exit(): 0, or an error in one line."""
    chosen = options(argv)
    logging.basicConfig(format="%(message)s")  # shows the warnings of worlds
    # ROS handles SIGINT itself. An exception in the middle of rclpy's executor would abort the process.
    signal.signal(signal.SIGINT, lambda *_: None)
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


def _check(chosen: argparse.Namespace) -> None:
    """Raises ValueError if options of worlds and maps do not fit."""
    if chosen.lifecycle and chosen.log:
        raise ValueError("found --lifecycle and --log, expected the parameter log_file instead of --log")
    if chosen.map is None and chosen.robot:
        raise ValueError("found --robot without --map, expected both")
    if chosen.map is not None and (chosen.world or not chosen.robot):
        raise ValueError(f"found --map {'and a world' if chosen.world else 'without --robot'}, expected --map with --robot")


def _world_of(chosen: argparse.Namespace, file: str) -> tuple[str, World]:
    """The name of the world in the log, and the world: that of the file, or of the map if there is none.

    Raises:
        ValueError, StageError, OSError: there is no such world.
    """
    options = _options.given_in(chosen)
    if file:
        return file, World(file, **options)
    if chosen.map is None:
        raise ValueError("found no world, expected one on the command line or in the parameter world_file, or --map")
    from ..maps import MapScene, read_map, robot_of

    robots = [robot_of(text) for text in chosen.robot]
    return chosen.map, World.of(MapScene.of(read_map(chosen.map), robots), **options)


def _run(chosen: argparse.Namespace) -> int:
    _check(chosen)
    if chosen.lifecycle:
        _run_lifecycle(chosen)
        return 0
    file, world = _world_of(chosen, "" if chosen.map is not None else world_file(chosen.world))
    with world:
        node = StageNode(world, gui=chosen.gui, log_file=chosen.log)
        try:
            _announce(node, file)
            figures = run_measured(node, chosen.duration)
        finally:
            node.close()
    if chosen.stats:
        print(figures, flush=True)
    return 0


def _announce(node: StageNode, file: str) -> None:
    """Logs what has been loaded, and opens the page."""
    node.get_logger().info(f"{printable(file)}: {len(node.robots)} robots, {node.topics} topics")
    if node.url:
        from ..live.command_line import open_page

        open_page(node.url)


def _run_lifecycle(chosen: argparse.Namespace) -> None:
    """Runs a lifecycle node. A world on the command line is the first value of the parameter world_file."""
    given = printable(chosen.world or "")  # ROS accepts only valid Unicode

    def world_of(file: str) -> tuple[str, World]:
        return _world_of(chosen, chosen.world if file and file == given else file)

    node = LifecycleStageNode(world_of, first=given, gui=chosen.gui, loaded=_announce)
    try:
        figures = run_measured(node, chosen.duration)
    finally:
        node.close()
    if chosen.stats:
        print(figures, flush=True)
