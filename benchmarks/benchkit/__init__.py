# SPDX-License-Identifier: GPL-2.0-or-later
"""What the benchmarks share: runs of programs, stores, progress, statistics, reports, plots."""
