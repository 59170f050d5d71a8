# SPDX-License-Identifier: GPL-2.0-or-later
"""What the benchmarks share: runs of programs, stores, progress, statistics, reports, plots.

inference, plots, progress and report are also in the Python package, as stagesim.benchkit, for
reports of sweeps: these import nothing from here but each other, by relative names.
"""
