# SPDX-License-Identifier: GPL-2.0-or-later
"""Typical uses of a simulator and the accuracy that each requires of a knob. Fixed limits let the
recommendation follow from the measurements.

results.Results.candidates() computes the figures that limits name. Lengths are in metres.
"""

from __future__ import annotations

from dataclasses import dataclass

from .analysis import Limit


@dataclass(frozen=True)
class Need:
    """Limits by knob. The fastest setting within the limits is recommended."""

    name: str
    why: str
    limits: dict[str, tuple[Limit, ...]]


CONTACT = Limit("contact_p95", 0.1, "p95 of gaps at contact at most 0.1 m")
SAME_SCORES = Limit("changed_scores", 0, "no score that differs significantly from the finest "
                                         "setting's, or by more than the spread between seeds")

NEEDS = (
    Need("obstacle avoidance in swarms",
         "The controller `disperse` keeps 0.1 m clear of everything. Readings of near objects must "
         "not miss a hit, and their errors must stay below half of that distance. Errors from "
         "sampling and from age may each reach the whole distance, and so may the gap at which "
         "cells stop a robot that drives at a wall.",
         {"cells": (Limit("near_p95", 0.05, "p95 of errors up to 2 m at most 0.05 m"),
                    Limit("missed_share", 0.001, "at most 0.1 % of readings miss a hit"), CONTACT),
          "samples": (Limit("near_p95", 0.1, "p95 between beams up to 2 m at most 0.1 m"),),
          "interval": (Limit("near_p95", 0.1, "p95 of held readings up to 2 m at most 0.1 m"),),
          "step": (Limit("drive_p95", 0.05, "p95 off the true arc at most 0.05 m"),)}),
    Need("scan matching, mapping",
         "Laser scanners scatter by 1 cm to 3 cm. The simulator's own error should stay below "
         "that, because it does not average out. A map must not contain false hits, and robots "
         "have to fit through doors.",
         {"cells": (Limit("p95", 0.01, "p95 of all errors at most 0.01 m"),
                    Limit("lost_share", 0.001, "at most 0.1 % of readings missed, false, or of the "
                                               "wrong object"), CONTACT),
          "samples": (Limit("p50", 0.01, "median between beams at most 0.01 m"),),
          "interval": (Limit("p95", 0.05, "p95 of held readings at most 0.05 m"),),
          "step": (Limit("drive_p95", 0.02, "p95 off the true arc at most 0.02 m"),)}),
    Need("what-if on a small board",
         "Only the result of the swarm counts, not single readings.",
         {knob: (SAME_SCORES,) for knob in ("cells", "samples", "interval", "step")}),
)
