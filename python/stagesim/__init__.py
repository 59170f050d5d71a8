# SPDX-License-Identifier: GPL-2.0-or-later
"""Stage 5, the 2D multi-robot simulator: worlds, fleets of robots as arrays, batches of worlds.

Unless stated otherwise, lengths are in metres, angles in radians counter-clockwise, and times in seconds of
simulated time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING as _TYPE_CHECKING

import numpy as _numpy  # noqa: F401  (the extension module creates NumPy arrays)

from . import _core
from ._contacts import BatchContacts
from ._core import Model, RangeSensor, Snapshot, View
from ._paths import shipped_worlds
from .batch import Batch
from .belief import Behaviour, Belief, ConsequenceEngine, Decision, Moments, OtherKind, Sightings
from .device_array import DeviceArray
from .errors import GoneError, StageError, WorldError
from .field import Field
from .fleet import Fleet, Messages, Reading, Sensor, sensor_types
from .futures import Futures
from .log import Log
from .pictures import Film, save_png
from .world import Contacts, World

if _TYPE_CHECKING:
    from . import scenarios, scenes

Ranger = Fiducials = Blobs = Camera = Sensor  # former names

__version__: str = _core.version()
__all__ = [
    "Batch", "BatchContacts", "Behaviour", "Belief", "ConsequenceEngine", "Contacts", "Decision", "DeviceArray", "Field",
    "Film", "Fleet", "Futures", "GoneError", "Log", "Messages", "Model", "Moments", "OtherKind", "RangeSensor", "Reading", "Sensor",
    "Sightings", "Snapshot", "StageError", "View", "World", "WorldError", "save_png", "scenarios", "scenes",
    "sensor_types", "shipped_worlds",
]


def __getattr__(name: str) -> object:
    """Imports stagesim.scenarios and stagesim.scenes when they are first needed."""
    if name in ("scenarios", "scenes"):
        from importlib import import_module

        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
