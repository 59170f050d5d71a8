# SPDX-License-Identifier: GPL-2.0-or-later
"""A robot, its plans and its goal, for tests of beliefs."""

from __future__ import annotations

import numpy as np

ROBOT = 'resolution 0.05\nposition( name "r" size [0.4 0.4 0.4] round 1 drive "diff" localization "gps" )\n'
PLANS = np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0, 0.5], [0.5, 0, -0.5]])
GOAL = (5, 0)
