#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of statistics that reports of sweeps use, with made-up runs whose true values are known."""

from __future__ import annotations

import math
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from benchkit.inference import contrast, mean_bounds  # noqa: E402  pylint: disable=wrong-import-position


class ContrastTest(unittest.TestCase):
    """Tests of differences between means."""

    def setUp(self) -> None:
        self.random = np.random.default_rng(7)

    def test_false_alarms_are_as_rare_as_they_should_be(self) -> None:
        alarms, covered = 0, 0
        for _ in range(200):
            found = contrast([self.random.normal(0, 1, 8)], [self.random.normal(0, 3, 12)])
            alarms += found.probability < 0.05
            covered += found.low <= 0 <= found.high
        self.assertLess(alarms, 20)  # 10 expected; 20 or more with a probability of about 0.001
        self.assertEqual(covered, 200 - alarms)

    def test_interval_has_the_truth_and_not_much_else(self) -> None:
        found = contrast([self.random.normal(2, 1, 400)], [self.random.normal(1, 1, 400)])
        self.assertLess(found.low, 1)
        self.assertGreater(found.high, 1)
        self.assertAlmostEqual(found.high - found.low, 2 * 1.96 * math.sqrt(2 / 400), delta=0.03)
        self.assertEqual(found.count, 800)

    def test_groups_count_alike_however_large(self) -> None:
        found = contrast([np.full(5, 1.0), np.full(500, 3.0)], [np.zeros(10)])
        self.assertEqual(found.difference, 2.0)

    def test_the_same_in_all_runs(self) -> None:
        always = contrast([np.ones(10)], [np.zeros(10)])
        self.assertEqual((always.low, always.high), (1.0, 1.0))
        self.assertLess(always.probability, 0.001)
        self.assertEqual(contrast([np.full(10, 0.1)], [np.full(10, 0.1)]).probability, 1.0)

    def test_too_few(self) -> None:
        found = contrast([np.arange(4.0)], [np.arange(9.0)])
        self.assertTrue(math.isnan(found.probability) and math.isnan(found.low))

    def test_few_that_are_mostly_alike_claim_nothing(self) -> None:
        """Resamples without scatter give infinite intervals."""
        found = contrast([np.array([0.0, 0, 0, 0, 1])])
        self.assertEqual((found.low, found.high), (-math.inf, math.inf))
        self.assertGreater(found.probability, 0.2)


class MeanTest(unittest.TestCase):
    """Tests of confidence intervals of means."""

    def test_bounds(self) -> None:
        values = np.random.default_rng(3).normal(5, 2, 100)
        low, high = mean_bounds(values)
        self.assertLess(low, values.mean())
        self.assertGreater(high, values.mean())
        self.assertAlmostEqual(high - low, 2 * 1.96 * 0.2, delta=0.12)

    def test_a_single_value_has_none(self) -> None:
        self.assertTrue(math.isnan(mean_bounds(np.ones(1))[0]))


if __name__ == "__main__":
    unittest.main()
