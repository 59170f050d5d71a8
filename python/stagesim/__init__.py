# SPDX-License-Identifier: GPL-2.0-or-later
"""Stage 5, the 2D multi-robot simulator."""

from __future__ import annotations

from . import _core
from .errors import GoneError, StageError, WorldError

__version__ = _core.version()
__all__ = ["GoneError", "StageError", "WorldError"]
