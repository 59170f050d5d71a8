# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line `python -m stagesim.maps import|export`, called by `stage import` and `stage export`."""

from __future__ import annotations

import argparse
import logging
import math
import os
import re
import sys
from collections.abc import Sequence
from typing import Any

from .. import _options
from .._checks import shown
from ..errors import StageError
from ..scenes import GridMap
from ..text import printable
from ..world import World
from .drawing import Drawing
from .files import WORLD_HEAD, write
from .reading import OPTIONS, read_map
from .robots import robot_of
from .scene import MapScene
from .world_map import map_of, write_map


def arguments() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(prog="stage", allow_abbrev=False, description="Makes worlds from maps, and maps from worlds.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="import|export")
    _add_import(commands)
    _add_export(commands)
    return parser


def _add_import(commands: Any) -> None:
    command = commands.add_parser(
        "import", help="make a world from a map or a drawing", allow_abbrev=False,
        description="Makes a world from map.yaml of ROS's map_server, a PGM or PNG, an array of NumPy (.npy), or the lines "
        "of an SVG or DXF.")
    command.add_argument("file", metavar="FILE", help=f"a file with the ending {', '.join(OPTIONS)}")
    command.add_argument("-o", "--out", metavar="WORLD", help="the world file (default: FILE with the ending .world)")
    command.add_argument("--robot", action="append", default=[], metavar="MACRO:X,Y,DEGREES",
                         help="add a robot of the folder robots, such as turtlebot3_burger:1,2,90; may be given several "
                              "times")
    command.add_argument("--height", type=_above_0, metavar="METRES", help="height of the walls (default: 1)")
    command.add_argument("--unknown", choices=("free", "occupied"), help="what unknown cells are (default: free)")
    command.add_argument("--resolution", type=_above_0, metavar="METRES",
                         help="side of a cell of a picture or an array (default: 0.05)")
    command.add_argument("--origin", type=_pose, metavar="X,Y,DEGREES",
                         help="pose of the lower left corner of a picture or an array, or of the origin of a drawing "
                              "(default: 0,0,0)")
    command.add_argument("--negate", action="store_true", default=None, help="light pixels of a picture are walls")
    command.add_argument("--scale", type=_above_0, metavar="METRES",
                         help="metres of a unit of a drawing (default: 1, or what a DXF says)")
    command.add_argument("--thickness", type=_above_0, metavar="METRES",
                         help="thickness of walls along lines of a drawing (default: 0.02)")


def _add_export(commands: Any) -> None:
    command = commands.add_parser(
        "export", help="make a map from a world", allow_abbrev=False,
        description="Makes map.yaml and its picture, for ROS's map_server, from what stands still in a world: not robots, nor "
        "what they can push or take. A cell is occupied if a body overlaps it.")
    command.add_argument("kind", choices=("map",), help="what to make")
    command.add_argument("world", metavar="WORLD", help="a world file, or the name of a shipped world")
    command.add_argument("-o", "--out", metavar="MAP.yaml", required=True, help="the map; its picture is beside it")
    command.add_argument("--resolution", type=_above_0, default=0.05, metavar="METRES",
                         help="side of a cell (default: 0.05)")
    command.add_argument("--height", type=_finite, metavar="METRES",
                         help="height of a lidar: only what it sees (default: all that stops robots or that rangers see)")
    area = command.add_mutually_exclusive_group()
    area.add_argument("--area", type=_area, metavar="X0,Y0,X1,Y1", help="the least x and y of the map, and the greatest ones "
                      "(default: all that stands still)")
    area.add_argument("--like", metavar="MAP.yaml", help="take resolution, size and origin of that map")
    _options.add_to(command)


def _finite(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not abs(number) <= 1e6:
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected a number")
    return number


def _area(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(number) for number in text.split(","))
    except ValueError:
        numbers = ()
    is_area = len(numbers) == 4 and all(abs(number) <= 1e6 for number in numbers)
    if not is_area or not (numbers[0] < numbers[2] and numbers[1] < numbers[3]):
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1")
    return numbers


def _above_0(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number <= 1e6:
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected a number above 0")
    return number


def _pose(text: str) -> tuple[float, float, float]:
    try:
        numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(math.isfinite(number) and abs(number) <= 1e6 for number in numbers):
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected X,Y or X,Y,DEGREES")
    return numbers[0], numbers[1], math.radians(numbers[2]) if len(numbers) == 3 else 0.0


def make_world(options: argparse.Namespace) -> str:
    """Runs the command `import`; returns a line about what it has made."""
    robots = [robot_of(text) for text in options.robot]
    walls = read_map(options.file, **{name: getattr(options, name) for name in (
        "height", "unknown", "resolution", "origin", "negate", "scale", "thickness")})
    scene = MapScene.of(walls, robots, f"{WORLD_HEAD} from {printable(os.path.basename(options.file))}.")
    out = options.out or os.path.splitext(options.file)[0] + ".world"
    folder = os.path.dirname(out)
    write(out, scene.text().encode(), f"# {WORLD_HEAD}".encode(), "an earlier world of stage import")
    for name, content in scene.pictures().items():
        write(os.path.join(folder, name), content, content, "the same picture")
    return f"{out}: {_size_of(walls)}; robots: {len(robots)}"


def make_map(options: argparse.Namespace) -> str:
    """Runs the command `export map`; returns a line about what it has made."""
    # It is not news here that controllers are ignored.
    logging.getLogger("stagesim").addFilter(lambda record: "controllers ignored" not in record.getMessage())
    like = None if options.like is None else GridMap.from_file(options.like)
    with World(options.world, **{"controllers": False, **_options.given_in(options)}) as world:
        made = map_of(world, options.resolution, height=options.height, area=options.area, like=like)
    write_map(made, options.out)
    rows, columns = made.shape
    return f"{options.out}: {columns} x {rows} cells of {made.resolution:g} m, {int(made.occupied.sum())} of them occupied"


def _size_of(walls: GridMap | Drawing) -> str:
    if isinstance(walls, GridMap):
        rows, columns = walls.shape
        return f"{columns} x {rows} cells of {walls.resolution:g} m, {int(walls.occupied.sum())} of them walls"
    x0, y0, x1, y1 = walls.bounds
    return f"{len(walls.polygons)} walls in {x1 - x0:g} x {y1 - y0:g} m"


def with_signs(words: Sequence[str]) -> list[str]:
    """Joins options and numbers that begin with a minus, which argparse takes as another option."""
    joined: list[str] = []
    for word in words:
        is_number = joined and joined[-1] in ("--origin", "--area", "--height") and re.match(r"-[\d.]", word)
        joined = [*joined[:-1], f"{joined[-1]}={word}"] if is_number else [*joined, word]
    return joined


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    words = sys.argv[1:] if argv is None else argv
    options = arguments().parse_args(_options.unambiguous(with_signs(words)))
    try:
        print(printable(make_world(options) if options.command == "import" else make_map(options)))
        return 0
    except (StageError, ValueError, OSError, ModuleNotFoundError) as error:
        print(f"stage {options.command}: {printable(str(error))}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
