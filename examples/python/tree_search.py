#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Finds the way out of a dead end by Monte Carlo tree search with the simulator as its model.

The robot drives a metre in one of four directions; going nearer to the goal leads nowhere. A node of the tree has a
state, a row of Batch.state(). To expand it, worlds of a batch load it, make one action each, and go on at random."""
import argparse

import numpy as np
import stagesim as st

WORLD = """define wall model( size [1 0.1 1] ) wall( pose [0 0 0 90] size [1.6 0.1 1] ) wall( pose [0.5 0.75 0 0] )
wall( pose [0.5 -0.75 0 0] ) position( name "r" drive "omni" pose [0.5 0 0 0] size [0.3 0.3 0.3] )"""
GOAL, ACTIONS = np.array([-1.5, 0]), {"right": (2, 0, 0), "up": (0, 2, 0), "left": (-2, 0, 0), "down": (0, -2, 0)}
REPEATS, DEPTH, LATER = 64, 8, 0.9  # worlds for each action, their actions, the worth of being one action later


class Node:
    def __init__(self, state: np.ndarray, worth: float = 0) -> None:
        self.state, self.worth, self.visits, self.after = state, worth, 1, []

    def best(self, c: float) -> int:  # the action with the highest upper bound of its worth
        return max(range(4), key=lambda i: self.after[i].worth + c * (np.log(self.visits) / self.after[i].visits)**.5)

    def visit(self, batch: st.Batch, random: np.random.Generator) -> float:  # the worth found below this node
        found = self.after[self.best(0.1)].visit(batch, random) if self.after else self.expand(batch, random)
        self.visits, self.worth = self.visits + 1, max(self.worth, LATER * found)
        return LATER * found

    def expand(self, batch: st.Batch, random: np.random.Generator) -> float:
        chosen, worth, moves = np.arange(batch.n) % len(ACTIONS), np.zeros(batch.n), np.array([*ACTIONS.values()])
        batch.load(self.state)
        for depth in range(DEPTH):
            batch.cmd[:, 0] = moves[random.permutation(chosen) if depth else chosen]
            batch.step(5)
            states = batch.state(range(len(ACTIONS))) if depth == 0 else states
            worth = np.maximum(worth, LATER**depth * np.exp(-np.linalg.norm(batch.pose[:, 0, :2] - GOAL, axis=1)))
        self.after = [Node(state, worth[chosen == i].max()) for i, state in enumerate(states)]
        return worth.max()


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="expand 50 nodes for each action instead of 200")
    visits, world = 50 if parser.parse_args(arguments).short else 200, st.World.from_text(WORLD)
    batch, real, random = st.Batch.of(world, len(ACTIONS) * REPEATS), st.Batch.of(world, 1), np.random.default_rng(1)
    root, way = Node(real.state()), []
    while (distance := np.linalg.norm(real.pose[0, 0, :2] - GOAL)) > 0.3 and len(way) < 20:
        for _ in range(visits):
            root.visit(batch, random)
        way.append([*ACTIONS][root.best(0)])
        real.cmd[...] = ACTIONS[way[-1]]
        real.step(5)
        root = root.after[root.best(0)]  # what is known below it stays known
    print(f"{distance:.2f} m from the goal after {len(way)} actions: {', '.join(way)}")
    return {"distance": float(distance), "actions": len(way)}


if __name__ == "__main__":
    main()
