# SPDX-License-Identifier: GPL-2.0-or-later
"""A running world in a browser: a page of its own, and Foxglove.

`python -m stagesim.live WORLD` does it for a world file, `Server` for a world that a program has made. It
needs `pip install "stagesim[live]"`, and `stagesim[foxglove]` for Foxglove.
"""

from __future__ import annotations

from .run import Run
from .scene import Frame, Scene, State, Wish
from .server import Server
from .show import Show

__all__ = ["Frame", "Run", "Scene", "Server", "Show", "State", "Wish"]
