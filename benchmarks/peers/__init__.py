# SPDX-License-Identifier: GPL-2.0-or-later
"""Comparison of stagesim with other simulators: one task, a module per simulator, checks that the work is done."""
