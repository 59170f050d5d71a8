# SPDX-License-Identifier: GPL-2.0-or-later
"""Renders environments to arrays or in a window."""

from __future__ import annotations

import importlib.util
from typing import Any

from gymnasium.error import DependencyNotInstalled

from ..batch import Batch
from ..pictures import Pixels

#: The available render modes; "human" needs pygame.
MODES = ("human", "rgb_array") if importlib.util.find_spec("pygame") else ("rgb_array",)


class Renderer:
    """Implements the render modes of environments.

    Args:
        mode: "rgb_array": return pictures; "human": show them in a window, which needs pygame; None: neither.
        size: width and height of pictures, pixels.
        fps: max pictures per second in the window, so that it runs in real time.

    Raises:
        ValueError: there is no such mode.
        DependencyNotInstalled: (gymnasium.error) pygame is not installed.
    """

    def __init__(self, mode: str | None, size: tuple[int, int], fps: float) -> None:
        if mode not in (None, "human", "rgb_array"):
            raise ValueError(f"found the render_mode {mode!r}, expected 'human', 'rgb_array' or None")
        self.mode = mode
        self._size = size
        self._fps = fps
        self._window = _Window(size, fps) if mode == "human" else None

    def picture(self, batch: Batch, index: int) -> Pixels:
        """Renders world `index`."""
        width, height = self._size
        return batch.render(index, width, height)

    def show(self, batch: Batch, index: int = 0) -> None:
        """Shows world `index` in the window, if there is one."""
        if self._window is not None:
            self._window.show(self.picture(batch, index))

    def close(self) -> None:
        """Closes the window."""
        if self._window is not None:
            self._window.close()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_window": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["mode"], state["_size"], state["_fps"])  # type: ignore[misc]


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
