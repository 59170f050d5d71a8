# SPDX-License-Identifier: GPL-2.0-or-later
"""A module per simulator, each imported only when it is measured."""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
from dataclasses import dataclass

from ..task import Task
from .simulation import Simulation


@dataclass(frozen=True)
class Peer:
    """A simulator that can be measured."""

    name: str
    title: str  # in tables
    module: str  # in this package
    needs: tuple[str, ...]  # modules that it imports
    package: str = ""  # on PyPI
    most_envs: int = 1 << 20  # it is not measured with more environments, because it has no batches
    cards: bool = False  # it has rows with a GPU

    def missing(self) -> str:
        """Returns which of its modules are not installed; empty: none."""
        return ", ".join(name for name in self.needs if importlib.util.find_spec(name) is None)

    def version(self) -> str:
        """Returns the version of its package; empty: unknown."""
        try:
            return importlib.metadata.version(self.package) if self.package else ""
        except importlib.metadata.PackageNotFoundError:
            return ""

    def open(self, task: Task, device: str, threads: int) -> Simulation:
        """Starts its simulation of a task."""
        module = importlib.import_module(f".{self.module}", __package__)
        simulation: Simulation = module.open_simulation(task, device, threads, self.name)
        return simulation


PEERS = (
    Peer("stage", "stagesim", "stage", ("stagesim",), cards=True),
    Peer("stage-cells", 'stagesim, `contacts "cells"`', "stage", ("stagesim",)),
    Peer("stage-exact", 'stagesim, `ray_model "exact"`', "stage", ("stagesim",), cards=True),
    Peer("vmas", "VMAS", "with_vmas", ("vmas", "torch"), "vmas", cards=True),
    Peer("navground", "Navground", "with_navground", ("navground",), "navground", most_envs=1024),
    Peer("ir-sim", "IR-SIM", "with_ir_sim", ("irsim",), "ir-sim", most_envs=16),
)


def peer_named(name: str) -> Peer:
    """Returns the peer with this name; raises KeyError if there is none."""
    return {peer.name: peer for peer in PEERS}[name]
