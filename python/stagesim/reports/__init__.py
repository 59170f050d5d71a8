# SPDX-License-Identifier: GPL-2.0-or-later
"""Statistics, tables, plots and progress of reports: for sweeps, and for the project's benchmarks.

These modules import nothing of stagesim but each other, by relative names.
"""
