# SPDX-License-Identifier: GPL-2.0-or-later
"""Shared parts of the benchmark programs: running the stage program, storing and judging its
figures."""
