# SPDX-License-Identifier: GPL-2.0-or-later
"""Renders environments to arrays or in a window."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass
from typing import Any, Callable, Sequence

import numpy as np
from gymnasium.error import DependencyNotInstalled

from ..batch import Batch
from ..fleet import Floats
from ..pictures import Pixels

#: The available render modes; "human" needs pygame.
MODES = ("human", "rgb_array") if importlib.util.find_spec("pygame") else ("rgb_array",)


#: The places that a task marks in a world: x, y, metres, shape (k, 2), by the number of the world.
Marks = Callable[[int], Floats]
MARK = (200, 30, 30)  # the colour of crosses


@dataclass(frozen=True)
class Rendering:
    """Decides what an environment renders.

    Args:
        mode: "rgb_array": return pictures; "human": show them in a window, which needs pygame; None: neither.
        size: width and height of pictures and of the window, pixels.
        worlds: number of worlds that the window shows side by side, from the first one on.
    """

    mode: str | None = None
    size: tuple[int, int] = (640, 480)
    worlds: int = 1


class Renderer:
    """Implements the render modes of environments.

    Args:
        rendering: what is rendered.
        fps: max pictures per second in the window, so that it runs in real time.

    Raises:
        ValueError: there is no such mode, or there are no worlds to show.
        DependencyNotInstalled: (gymnasium.error) pygame is not installed.
    """

    def __init__(self, rendering: Rendering, fps: float) -> None:
        if rendering.mode not in (None, "human", "rgb_array"):
            raise ValueError(f"found the render_mode {rendering.mode!r}, expected 'human', 'rgb_array' or None")
        if rendering.worlds < 1:
            raise ValueError(f"found {rendering.worlds} worlds to render, expected 1 or more")
        self._rendering = rendering
        self._fps = fps
        self._window = _Window(rendering.size, fps) if rendering.mode == "human" else None

    def picture(self, batch: Batch, index: int, marks: Marks) -> Pixels:
        """Renders world `index`, with crosses at the marks of its task."""
        return _marked(batch, index, *self._rendering.size, marks(index))

    def mosaic(self, batch: Batch, worlds: Sequence[int], marks: Marks) -> Pixels:
        """Renders worlds side by side, in rows from the top, in a picture of the usual size."""
        width, height = self._rendering.size
        columns = math.ceil(math.sqrt(len(worlds)))
        rows = math.ceil(len(worlds) / columns)
        whole = np.zeros((height, width, 3), np.uint8)
        xs, ys = np.linspace(0, width, columns + 1).astype(int), np.linspace(0, height, rows + 1).astype(int)
        for number, world in enumerate(worlds):
            row, column = divmod(number, columns)
            top, left = ys[row], xs[column]
            tile = whole[top:ys[row + 1], left:xs[column + 1]]
            tile[...] = _marked(batch, world, tile.shape[1], tile.shape[0], marks(world))
        return whole

    def show(self, batch: Batch, marks: Marks) -> None:
        """Shows the first worlds in the window, if there is one."""
        if self._window is not None:
            count = min(self._rendering.worlds, batch.n)
            self._window.show(self.picture(batch, 0, marks) if count == 1 else self.mosaic(batch, range(count), marks))

    def close(self) -> None:
        """Closes the window."""
        if self._window is not None:
            self._window.close()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_window": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["_rendering"], state["_fps"])  # type: ignore[misc]


def _marked(batch: Batch, index: int, width: int, height: int, marks: Floats) -> Pixels:
    """Renders a world from above, with crosses at places: x, y, metres, shape (k, 2)."""
    x, y, scale = batch._core.fit(batch._index(index), width, height)
    pixels = batch.render(index, width, height, center=(x, y), scale=scale)
    columns = np.rint(width / 2 + (marks[:, 0] - x) * scale)
    rows = np.rint(height / 2 - (marks[:, 1] - y) * scale)
    arm = max(2, min(width, height) // 100)
    for row, column in zip(rows.tolist(), columns.tolist()):
        if arm <= row < height - arm and arm <= column < width - arm:
            i, j = int(row), int(column)
            for step in range(-arm, arm + 1):
                pixels[i + step:i + step + 2, j + step:j + step + 2] = MARK
                pixels[i + step:i + step + 2, j - step:j - step + 2] = MARK
    return pixels


class _Window:
    """A pygame window, which opens with the first picture."""

    def __init__(self, size: tuple[int, int], fps: float) -> None:
        try:
            import pygame
        except ImportError as error:
            raise DependencyNotInstalled("found no pygame, which render_mode=\"human\" needs; "
                                         'try: pip install "stagesim[env]"') from error
        self._pygame: Any = pygame
        self._size = size
        self._fps = fps
        self._surface: Any = None

    def show(self, pixels: Pixels) -> None:
        pygame = self._pygame
        if self._surface is None:
            pygame.display.init()
            pygame.display.set_caption("Stage")
            self._surface = pygame.display.set_mode(self._size)
            self._clock = pygame.time.Clock()
        picture = pygame.image.frombuffer(pixels.tobytes(), self._size, "RGB")
        self._surface.blit(picture, (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        if self._surface is not None:
            self._pygame.display.quit()
            self._surface = None
