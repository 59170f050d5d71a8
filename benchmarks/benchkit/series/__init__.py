# SPDX-License-Identifier: GPL-2.0-or-later
"""What the benchmark programs share: running the stage program, keeping and judging its figures."""
