# SPDX-License-Identifier: GPL-2.0-or-later
"""Shows a running world in a browser, on its own page and in Foxglove.

`python -m stagesim.live WORLD` shows a world file; `Server` shows a world of a Python program. The page needs
`pip install "stagesim[live]"`, Foxglove needs `stagesim[foxglove]`.
"""

from __future__ import annotations

from .run import Run
from .scene import Frame, Scene, State, Wish
from .server import Server
from .show import Show

__all__ = ["Frame", "Run", "Scene", "Server", "Show", "State", "Wish"]
