# SPDX-License-Identifier: GPL-2.0-or-later
"""Experiments with a row for each robot, and their tables in Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from trips import Driver, Noise, Scene, Trip, travel


FIRST_SEED = 1000  #: robots were tuned with smaller ones, which count in no table


class Row(NamedTuple):
    """A row of a table: a robot in a scene that differs from seed to seed."""

    names: tuple[str, ...]
    scene: Callable[[int], Scene]
    driver: Callable[[Scene, int], Driver]
    noise: Noise


class Experiment(NamedTuple):
    """A table of trips."""

    title: str
    heads: tuple[str, ...]  #: of the first columns
    rows: Sequence[Row]
    saves: bool = False  #: whether somebody is to be kept from a hole

    def tasks(self, seeds: int) -> list[tuple[int, int]]:
        """Row and seed of each trip, the rows that take longest first."""
        return [(row, seed) for row in reversed(range(len(self.rows))) for seed in range(FIRST_SEED, FIRST_SEED + seeds)]

    def work(self, task: tuple[int, int], patience: float) -> Trip:
        """Makes a trip, of at most `patience` seconds."""
        row, seed = self.rows[task[0]], task[1]
        scene = row.scene(seed)
        scene = scene._replace(patience=min(patience, scene.patience))
        return travel(scene, row.driver(scene, seed), row.noise, seed)

    def table(self, results: dict[Any, Trip], watts: float) -> list[str]:
        """The lines of the table."""
        heads = [*self.heads, "collisions", *(["H is saved"] if self.saves else []), "arrives", "time to goal, s", "decisions/s",
                 "J/decision"]
        lines = [line_of(heads), line_of(["---"] * len(heads))]
        for number, row in enumerate(self.rows):
            trips = [trip for (of, _), trip in sorted(results.items()) if of == number]
            lines.append(line_of([*row.names, *self.figures(trips, watts)]))
        return lines

    def figures(self, trips: list[Trip], watts: float) -> list[str]:
        """The cells of a row after the names."""
        arrived = [trip.seconds for trip in trips if trip.arrived]
        seconds = sum(trip.thought for trip in trips) / sum(trip.decisions for trip in trips)
        saved = [share(sum(not trip.fell for trip in trips), len(trips))] if self.saves else []
        return [share(sum(trip.collided for trip in trips), len(trips)), *saved, share(len(arrived), len(trips)),
                f"{np.median(arrived):.1f}" if arrived else "none arrives", f"{1 / seconds:.{1 if seconds > 0.02 else 0}f}",
                f"{watts * seconds:.2g}"]


def line_of(cells: Sequence[str]) -> str:
    """A line of a table."""
    return "| " + " | ".join(cells) + " |"


def share(count: int, n: int) -> str:
    """A count with its share in percent, by Wilson's interval."""
    low, high = wilson(count, n)
    return f"{count} of {n} ({100 * low:.0f} to {100 * high:.0f} %)"


def wilson(count: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's interval of a probability; its confidence is 95 % with this z."""
    middle = (count + z * z / 2) / (n + z * z)
    half = z / (n + z * z) * math.sqrt(count * (n - count) / n + z * z / 4)
    return max(0.0, middle - half), min(1.0, middle + half)


def binomial_interval(n: int, probability: float, beyond: float) -> tuple[int, int]:
    """Counts that a binomial distribution leaves with a probability of at most `beyond`, half of it on each side."""
    logs = [math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1) for k in range(n + 1)]
    p = min(max(probability, 1e-12), 1 - 1e-12)
    chances = np.exp([log + k * math.log(p) + (n - k) * math.log1p(-p) for k, log in enumerate(logs)])
    below = np.cumsum(chances)
    return int((below <= beyond / 2).sum()), int((below < 1 - beyond / 2).sum())
