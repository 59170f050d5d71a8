# SPDX-License-Identifier: GPL-2.0-or-later
"""The pieces of benchmarks/accuracy."""
