# SPDX-License-Identifier: GPL-2.0-or-later
"""The description of an experiment."""

from __future__ import annotations

import importlib.util
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Mapping, Union

import numpy as np

from .. import _paths
from .._options import setting_text
from .plan import SweepError

#: Runs of each set of values: their number, a range, or (first, last) where `last` is excluded.
Runs = Union[int, range, "tuple[int, int]"]
#: Options of `stage sweep` that say how runs are done; they are not part of a sweep's plan.
EFFORT = {"fresh", "limit-mb", "limit-seconds", "tries"}


@dataclass(frozen=True)
class Experiment:
    """A world file, values of its settings, and seeds: each combination of values with each seed is a run.

    Attributes:
        world: path of the world file, or the name of a shipped world, as in World().
        set: for each setting, as in World(), one value or a list of values. A value is a number, a string, or a
            tuple as in world files.
        runs: runs of each set of values: their number, or range(100, 200), or (100, 200).
        seed: seed of the experiment. The seed of a run is derived from it, the run's values and its number.
        common_seeds: True: derive it without the values, so that sets can be compared in pairs.
        duration: simulated seconds of a run; None: the quit time of the world file.
        metrics: additional metrics in Python, as "module:name". A function gets the World at the end of a run
            and returns a dict of numbers. A class is instantiated with the World before the first step, its
            step() is called after each step, and its result() returns the dict. All workers must be able to
            import the module.
        options: options of `stage sweep` by name, such as {"ray-model": "exact", "limit-seconds": 60}; True: an
            option without a value.
    """

    world: str | os.PathLike[str]
    set: Mapping[str, Any] = field(default_factory=dict)
    runs: Runs = 1
    seed: int = 1
    common_seeds: bool = False
    duration: float | None = None
    metrics: str | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def arguments(self) -> list[str]:
        """The arguments of `stage sweep` for this experiment, without the output folder.

        Raises:
            ValueError: there are no runs, or a setting has no values or one with a comma.
        """
        first, last = bounds_of(self.runs)
        words = [_paths.resolve(self.world), f"--runs={first}:{last}", f"--seed={self.seed}"]
        for name, values in self.set.items():
            texts = [setting_text(value) for value in values_of(values)]
            if not texts or any("," in text for text in texts):
                raise ValueError(f"found {values!r} for {name}, expected one value or more, none with a comma")
            words.append(f"--set={name}={','.join(texts)}")
        if self.common_seeds:
            words.append("--common-seeds")
        if self.duration is not None:
            words.append(f"--duration={self.duration!r}")
        return words + option_words(self.options, lambda name: name not in EFFORT)

    def effort(self) -> list[str]:
        """The options in EFFORT, which say how runs are done but not which."""
        return option_words(self.options, lambda name: name in EFFORT)


def bounds_of(runs: Runs) -> tuple[int, int]:
    """The runs as (first, last) with `last` excluded. Raises ValueError if there are none."""
    if isinstance(runs, range):
        first, last = runs.start, runs.stop
        if runs.step != 1:
            raise ValueError(f"found {runs}, expected a range without a step")
    else:
        first, last = (0, runs) if isinstance(runs, int) else runs
    if not 0 <= first < last:
        raise ValueError(f"found the runs {first} to before {last}, expected one or more, from 0 on")
    return first, last


def values_of(values: Any) -> list[Any]:
    """The values of a setting as a list."""
    if isinstance(values, (list, tuple, range, np.ndarray)):
        return list(values)
    return [values]


def option_words(options: Mapping[str, Any], wanted: Callable[[str], bool]) -> list[str]:
    """Formats options as arguments of a command line; None and False omit an option."""
    words = []
    for name, value in options.items():
        if not wanted(name):
            continue
        if value is True:
            words.append(f"--{name}")
        elif value is not None and value is not False:
            words.append(f"--{name}={value}")
    return words


def folder_of(metrics: str) -> str:
    """The folder that the module of "module:name" is imported from.

    Raises:
        SweepError: there is no such module.
    """
    module, colon, name = metrics.partition(":")
    top = module.split(".")[0]
    spec = importlib.util.find_spec(top) if top and colon and name else None
    if spec is None or spec.origin is None:
        raise SweepError(f"found the metrics {metrics!r}, expected \"module:name\" of a module that can be imported")
    file = Path(spec.origin).resolve()
    return str(file.parents[1] if spec.submodule_search_locations else file.parent)
