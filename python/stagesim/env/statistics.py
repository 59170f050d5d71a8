# SPDX-License-Identifier: GPL-2.0-or-later
"""Statistics of the last episodes of an environment."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..fleet import Floats


class Statistics:
    """Returns, lengths and success of the last episodes.

    A return is the sum of the rewards of all robots. A flag of the task's info, such as "is_success", counts as it was
    when each robot's episode ended: its rate is the share of robots.

    Args:
        window: number of episodes that are kept, 1 or more.
    """

    def __init__(self, window: int = 1000) -> None:
        self.window = window  #: number of episodes that are kept
        self.count = 0  #: number of episodes that have ended since the environment was made
        self._columns: dict[str, Floats] = {}

    def add(self, **columns: npt.ArrayLike) -> None:
        """Adds episodes: a column of numbers for each name, all of one length."""
        if not self._columns:
            self._columns = {name: np.full(self.window, np.nan) for name in columns}
        length = len(np.asarray(columns["returns"]))
        places = np.arange(self.count, self.count + length)[-self.window:] % self.window
        for name, values in columns.items():
            column = self._columns.setdefault(name, np.full(self.window, np.nan))
            column[places] = np.asarray(values, np.float64)[-self.window:]
        self.count += length

    def last(self, most: int | None = None) -> dict[str, Floats]:
        """The last episodes, oldest first: "returns", "lengths" (actions) and a rate for each flag.

        Args:
            most: max number of episodes; None: all that are kept.
        """
        count = min(self.count, self.window, self.window if most is None else most)
        places = np.arange(self.count - count, self.count) % self.window
        return {name: column[places] for name, column in self._columns.items()}

    def mean(self, most: int | None = None) -> dict[str, float]:
        """The means of last(); empty before the first episode has ended."""
        return {name: float(values.mean()) for name, values in self.last(most).items()}

    def __repr__(self) -> str:
        means: dict[str, Any] = {name: f"{value:.3g}" for name, value in self.mean().items()}
        return f"<Statistics of {self.count} episodes, means of the last {min(self.count, self.window)}: {means}>"
