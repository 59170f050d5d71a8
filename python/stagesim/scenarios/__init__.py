# SPDX-License-Identifier: GPL-2.0-or-later
"""Named scenarios with pedestrians, and metrics of how robots move among people."""

from __future__ import annotations

from .catalogue import names, scenario
from .drawing import draw, save_picture
from .metrics import (INTIMATE, PERSONAL, arrival_times, closest_distances, collisions, crossing_times, flow,
                      intrusion_times, path_lengths)
from .recording import Recording, measures, record
from .scenario import Scenario
from .sweep_metrics import Social

__all__ = [
    "INTIMATE", "PERSONAL", "Recording", "Scenario", "Social", "arrival_times", "closest_distances", "collisions",
    "crossing_times", "draw", "flow", "intrusion_times", "measures", "names", "path_lengths", "record", "save_picture",
    "scenario",
]
