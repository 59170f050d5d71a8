# SPDX-License-Identifier: GPL-2.0-or-later
"""Drawings in DXF, read by ezdxf."""

from __future__ import annotations

from itertools import islice
from typing import Any

from .drawing import MOST_CORNERS, Drawing, Points, walls_along

#: Lines and curves that become walls.
LINES = ("LINE", "LWPOLYLINE", "POLYLINE", "CIRCLE", "ARC", "ELLIPSE", "SPLINE")
#: Greatest distance of a curve from the straight walls that stand for it, metres.
TOLERANCE = 0.005
#: Entities, and those of all inserted blocks, that are looked at.
MOST_ENTITIES = 200_000


def read_dxf(path: str, scale: float | None = None, thickness: float = 0.02, height: float = 1.0) -> Drawing:
    """Reads the lines of the model space of a DXF file, with those of inserted blocks; they become walls.

    Args:
        path: the file, as text or binary.
        scale: metres of a unit; None: by $INSUNITS, or 1 if the file has no units.
        thickness: that of the walls, metres.
        height: that of the walls, metres.
    """
    ezdxf = _library()
    try:
        document = ezdxf.readfile(path)
        metres = scale if scale is not None else _metres_of(document)
        walls: list[Points] = []
        for entity in _entities(document.modelspace()):
            walls += _walls_of(entity, metres, thickness)
            if len(walls) * 4 > MOST_CORNERS:
                raise ValueError(f"found more than {MOST_CORNERS // 4} walls, expected a floor plan")
    except ValueError:
        raise
    except Exception as error:  # pylint: disable=broad-except  # damaged files make ezdxf raise many kinds
        raise ValueError(f"not a DXF file that can be read: {type(error).__name__}: "
                         f"{(str(error).splitlines() or [''])[0]}") from None
    return Drawing(walls, height)


def _library() -> Any:
    try:
        import ezdxf
        import ezdxf.path
        import ezdxf.units
    except ImportError as error:
        raise ModuleNotFoundError(f"DXF files need the package ezdxf: pip install ezdxf ({error})") from None
    return ezdxf


def _metres_of(document: Any) -> float:
    """Metres of a unit of the document."""
    from ezdxf import units
    from ezdxf.enums import InsertUnits

    try:
        unit = InsertUnits(document.units)
        return float(units.conversion_factor(unit, InsertUnits.Meters)) if document.units else 1.0
    except (TypeError, ValueError):
        return 1.0


def _entities(space: Any) -> Any:
    """The lines in the model space and in inserted blocks."""
    waiting, looked = list(space)[::-1], 0
    while waiting:
        looked += 1
        if looked > MOST_ENTITIES:
            raise ValueError(f"found more than {MOST_ENTITIES} entities, expected a floor plan")
        entity = waiting.pop()
        kind = entity.dxftype()
        if kind == "INSERT":
            copies = islice(entity.multi_insert(), MOST_ENTITIES) if entity.mcount > 1 else [entity]
            for copy in copies:
                waiting += list(copy.virtual_entities())
                if len(waiting) > MOST_ENTITIES:
                    raise ValueError(f"found more than {MOST_ENTITIES} entities, expected a floor plan")
        elif kind in LINES:
            yield entity


def _walls_of(entity: Any, metres: float, thickness: float) -> list[Points]:
    from ezdxf import path

    if entity.dxftype() == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
        return []  # a mesh
    points = islice(path.make_path(entity).flattening(TOLERANCE / metres), MOST_CORNERS)
    return walls_along([(point.x * metres, point.y * metres) for point in points], thickness)
