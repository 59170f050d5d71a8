# SPDX-License-Identifier: GPL-2.0-or-later
"""Drawings in SVG. Paths, transforms and colours are read by svgelements."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from .._checks import shown
from .drawing import MOST_CORNERS, Drawing, Points, walls_along

#: Greatest distance of a curve from the straight walls that stand for it, metres.
TOLERANCE = 0.005
#: Elements that are looked at, with those that are used several times, and how deep they may be nested.
MOST_ELEMENTS, DEEPEST = 100_000, 100

#: Elements with other elements that are drawn.
GROUPS = ("svg", "g", "a")
#: Shapes, and their attributes that are numbers.
SHAPES = {"path": (), "line": ("x1", "y1", "x2", "y2"), "rect": ("x", "y", "width", "height", "rx", "ry"),
          "circle": ("cx", "cy", "r"), "ellipse": ("cx", "cy", "rx", "ry"), "polyline": (), "polygon": ()}


class Look(NamedTuple):
    """Whether an element has dark lines and areas; elements in it have the same unless they say otherwise."""

    lines: bool = False
    areas: bool = True


def read_svg(path: str, scale: float | None = None, thickness: float = 0.02, height: float = 1.0) -> Drawing:
    """Reads the dark lines and areas of an SVG, which become walls. The lower left corner of the page is at (0, 0).

    Args:
        path: the file.
        scale: metres of a unit of the drawing; None: 1.
        thickness: that of walls along lines, metres.
        height: that of the walls, metres.
    """
    library = _library()
    root = _root_of(path)
    metres = 1.0 if scale is None else scale
    box = _numbers(root.get("viewBox", ""))
    bottom = box[1] + box[3] if len(box) == 4 else _length(root.get("height", ""))
    left = box[0] if len(box) == 4 else 0.0
    reader = _Reader(library, root, library.Matrix(metres, 0, 0, -metres, -left * metres, bottom * metres), thickness)
    walls: list[Points] = []
    corners = 0
    try:
        for wall in reader.walls():
            walls.append(wall)
            corners += len(wall)
            if corners > MOST_CORNERS:
                raise ValueError(f"found walls with more than {MOST_CORNERS} corners, expected a floor plan")
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:  # those of svgelements for damaged paths
        raise ValueError(f"not an SVG that can be read: {type(error).__name__}: {error}") from None
    return Drawing(walls, height)


def _library() -> Any:
    try:
        import svgelements
    except ImportError as error:
        raise ModuleNotFoundError(f"SVG files need the package svgelements: pip install svgelements ({error})") from None
    return svgelements


def _root_of(path: str) -> ElementTree.Element:
    """The root of an XML file without declarations of entities, which could make it endless."""
    with open(path, "rb") as file:
        content = file.read()
    checker = expat.ParserCreate()
    checker.EntityDeclHandler = _refuse_entity
    try:
        checker.Parse(content, True)
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, expat.ExpatError) as error:
        raise ValueError(f"not an SVG: {error}") from None
    if _name(root) != "svg":
        raise ValueError(f"found the element {_name(root)[:40]!r}, expected svg")
    return root


def _refuse_entity(*_: object) -> None:
    raise ValueError("found a declaration of entities, expected none")


def _name(element: ElementTree.Element) -> str:
    """The name of an element without its namespace; comments have none."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", text)]


def _length(text: str) -> float:
    """The number of a length; its unit is ignored."""
    numbers = _numbers(text)
    return numbers[0] if numbers else 0.0


class _Reader:
    def __init__(self, library: Any, root: ElementTree.Element, frame: Any, thickness: float) -> None:
        self._library, self._root, self._frame, self._thickness = library, root, frame, thickness
        self._by_id = {element.get("id"): element for element in root.iter() if element.get("id")}
        self._looked = 0
        self._rules = [(selector.strip(), body) for element in root.iter() if _name(element) == "style"
                       for selectors, body in re.findall(r"([^{}]+)\{([^{}]*)\}", element.text or "")
                       for selector in selectors.split(",")]

    def walls(self) -> Iterator[Points]:
        """Outlines of all walls, metres."""
        return self._walls_of(self._root, self._frame, Look(), 0)

    def _walls_of(self, element: ElementTree.Element, frame: Any, look: Look, depth: int) -> Iterator[Points]:
        self._looked += 1
        if self._looked > MOST_ELEMENTS or depth > DEEPEST:
            raise ValueError(f"found more than {MOST_ELEMENTS} elements, or {DEEPEST} in each other, expected a floor plan")
        name = _name(element)
        if name not in GROUPS and name not in SHAPES and name != "use":
            return
        style = self._style_of(element, name)
        if style.get("display") == "none" or style.get("visibility") in ("hidden", "collapse"):
            return
        look = Look(self._is_dark(style.get("stroke"), look.lines), self._is_dark(style.get("fill"), look.areas))
        if element.get("transform"):
            frame = self._library.Matrix(element.get("transform")) * frame
        if name in SHAPES:
            yield from self._walls_of_shape(self._shape_of(element, name), frame, look)
        elif name == "use":
            link = element.get("href") or element.get("{http://www.w3.org/1999/xlink}href") or ""
            used = self._by_id.get(link.removeprefix("#"))
            if used is not None:
                x, y = _length(element.get("x", "")), _length(element.get("y", ""))
                yield from self._walls_of(used, self._library.Matrix(1, 0, 0, 1, x, y) * frame, look, depth + 1)
        else:
            for child in element:
                yield from self._walls_of(child, frame, look, depth + 1)

    def _style_of(self, element: ElementTree.Element, name: str) -> dict[str, str]:
        """Attributes, overridden by the sheet of styles and then by the attribute `style`."""
        classes = [f".{each}" for each in element.get("class", "").split()]
        names = {name, *classes, *(name + each for each in classes), f"#{element.get('id')}"}
        texts = [body for selector, body in self._rules if selector in names] + [element.get("style", "")]
        style: dict[str, str] = {key: element.attrib[key] for key in ("stroke", "fill", "display", "visibility") if key in element.attrib}
        for declaration in ";".join(texts).split(";"):
            key, _, value = declaration.partition(":")
            style[key.strip()] = value.strip()
        return style

    def _is_dark(self, color: str | None, inherited: bool) -> bool:
        """Whether something of this colour is a wall: its luminance is below a half, as for pictures."""
        if color is None or color in ("", "inherit"):
            return inherited
        if color in ("none", "transparent"):
            return False
        try:
            found = self._library.Color(color)
            return bool(0.299 * found.red + 0.587 * found.green + 0.114 * found.blue < 127.5 and found.alpha > 127)
        except (TypeError, ValueError):
            return True  # such as currentColor, or a pattern

    def _shape_of(self, element: ElementTree.Element, name: str) -> Any:
        """The path of a shape, in the units of the drawing."""
        library, get = self._library, element.get
        x, y, *rest = [_length(get(key, "")) for key in SHAPES[name]] or [0.0, 0.0]
        if name == "path":
            return self._path_of(get("d", ""))
        if name in ("polyline", "polygon"):
            values = _numbers(get("points", ""))
            points = [f"{x} {y}" for x, y in zip(values[::2], values[1::2])]
            return library.Path(f"M {' L '.join(points)}{' Z' if name == 'polygon' else ''}" if points else "")
        if name == "line":
            return library.Path(f"M {x} {y} L {rest[0]} {rest[1]}")
        if name == "rect":
            rx, ry = rest[2] or rest[3], rest[3] or rest[2]
            return library.Path(library.Rect(x, y, rest[0], rest[1], rx, ry))
        rx, ry = (rest[0], rest[0]) if name == "circle" else (rest[0], rest[1])
        return library.Path(library.Ellipse(x, y, rx, ry))

    def _path_of(self, text: str) -> Any:
        try:
            return self._library.Path(text)
        except Exception:  # pylint: disable=broad-except  # damaged paths make svgelements raise many kinds
            raise ValueError(f"found the path {shown(text)}, expected one as in SVG") from None

    def _walls_of_shape(self, shape: Any, frame: Any, look: Look) -> Iterator[Points]:
        if not (look.lines or look.areas):
            return
        for line in self._lines_of(abs(shape * frame)):
            corners = line[:-1] if line[0] == line[-1] else line
            if look.areas and len(corners) > 2:
                yield np.array(corners)
            if look.lines:
                yield from walls_along(line, self._thickness)

    def _lines_of(self, path: Any) -> Iterator[list[tuple[float, float]]]:
        """The points of each part of a path, metres. A closed part ends where it begins."""
        line: list[tuple[float, float]] = []
        for segment in path:
            if isinstance(segment, self._library.Move):
                if len(line) > 1:
                    yield line
                line = [(segment.end.x, segment.end.y)]
            elif segment.start is not None and segment.end is not None:
                line += self._points_of(segment)
        if len(line) > 1:
            yield line

    def _points_of(self, segment: Any) -> list[tuple[float, float]]:
        """The points of a segment after its start."""
        if isinstance(segment, (self._library.Line, self._library.Close)):
            return [(segment.end.x, segment.end.y)]
        count = min(MOST_CORNERS, math.ceil(math.sqrt(_reach(segment, self._library) / TOLERANCE)) + 1)
        points = segment.npoint(np.linspace(0, 1, count + 1)[1:]) if hasattr(segment, "npoint") else []
        return [(float(x), float(y)) for x, y in points]


def _reach(segment: Any, library: Any) -> float:
    """A length, such that its square root in units of the tolerance is enough points for a curve."""
    if isinstance(segment, library.Arc):
        return float(max(abs(segment.rx), abs(segment.ry)) * abs(segment.sweep))
    points = [point for point in (segment.start, getattr(segment, "control", None), getattr(segment, "control1", None),
                                  getattr(segment, "control2", None), segment.end) if point is not None]
    return float(sum(abs(b - a) for a, b in zip(points, points[1:])))
