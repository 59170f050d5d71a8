# SPDX-License-Identifier: GPL-2.0-or-later
"""Regions of a black-and-white picture, for tools/dev/draw_maps."""

from __future__ import annotations

import numpy as np


def runs_of(line: np.ndarray) -> list[tuple[int, int]]:
    """Return the half-open ranges [begin, end) of true values in a row."""
    change = np.flatnonzero(np.diff(np.concatenate(([0], line.astype(np.int8), [0]))))
    return list(zip(change[0::2].tolist(), change[1::2].tolist()))


def connected_parts(free: np.ndarray) -> list[list[tuple[int, int, int]]]:
    """Return the edge-connected components of a mask, largest first, as runs (row, begin, end)."""
    parent: list[int] = []
    runs: list[tuple[int, int, int]] = []

    def root(node: int) -> int:
        while parent[node] != node:
            parent[node] = parent[parent[node]]
            node = parent[node]
        return node

    above: list[int] = []
    for row in range(free.shape[0]):
        here, at = [], 0
        for begin, end in runs_of(free[row]):
            node = len(runs)
            runs.append((row, begin, end))
            parent.append(node)
            here.append(node)
            while at < len(above) and runs[above[at]][2] <= begin:
                at += 1
            touching = at
            while touching < len(above) and runs[above[touching]][1] < end:
                parent[root(above[touching])] = root(node)
                touching += 1
        above = here
    parts: dict[int, list[tuple[int, int, int]]] = {}
    for node, run in enumerate(runs):
        parts.setdefault(root(node), []).append(run)
    return sorted(parts.values(), key=lambda part: -sum(end - begin for _, begin, end in part))


def grown_by_disc(mask: np.ndarray, radius: int) -> np.ndarray:
    """Return the mask dilated by a disc of `radius` pixels."""
    rows, columns = mask.shape
    grown = np.zeros((rows + 2 * radius, columns + 2 * radius), dtype=bool)
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            if dx * dx + dy * dy <= radius * radius:
                grown[radius + dy:radius + dy + rows, radius + dx:radius + dx + columns] |= mask
    return grown[radius:radius + rows, radius:radius + columns]
