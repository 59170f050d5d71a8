# SPDX-License-Identifier: GPL-2.0-or-later
"""Shows the progress of a sweep."""

from __future__ import annotations

from contextlib import contextmanager
from typing import Callable, Iterator

from ..reports.progress import Progress as Bar

#: A function that gets the number of finished runs and the number of all runs.
Progress = Callable[[int, int], object]


@contextmanager
def shown(progress: bool | Progress) -> Iterator[Progress]:
    """Yields the progress function: the caller's own, one that draws a bar (True), or a silent one (False)."""
    if callable(progress):
        yield progress
    elif not progress:
        yield lambda done, total: None
    else:
        bar: list[Bar] = []
        last = 0

        def draw(done: int, total: int) -> None:
            nonlocal last
            if not bar:
                bar.append(Bar(total=total - done))
            else:
                bar[0].advance(max(0, done - last), f"{done} of {total} runs")
            last = done

        try:
            yield draw
        finally:
            for made in bar:
                made.clear()
