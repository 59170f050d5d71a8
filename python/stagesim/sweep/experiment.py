# SPDX-License-Identifier: GPL-2.0-or-later
"""What is to be tried."""

from __future__ import annotations

import importlib.util
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Mapping, Union

import numpy as np

from .. import _paths
from ..world import setting_text
from .plan import SweepError

#: How many, a range, or the first one and the one after the last.
Runs = Union[int, range, "tuple[int, int]"]
#: Options of `stage sweep` that are no part of a sweep's plan.
EFFORT = {"fresh", "limit-mb", "limit-seconds", "tries"}


@dataclass(frozen=True)
class Experiment:
    """A world file, settings of it that are varied, and seeds: each set of values with each seed is a run.

    Attributes:
        world: the world file; a plain name as in World().
        set: for each setting, as in World(), the values that it takes: a list or the like for several, or
            just one. A value may be a number, a text, or a tuple as in world files.
        runs: of each set of values: how many, or which: range(100, 200), or (100, 200).
        seed: of the experiment. Each run gets a seed of its own, made from this one, its values and its number.
        common_seeds: runs of the same number get the same seed, whatever the values: for comparisons in pairs.
        duration: simulated seconds of a run; None: as long as the world file says.
        metrics: what else is measured, in Python: "module:name" of a function that gets the World at the end
            of a run and returns a dict of numbers; or of a class that is made with the World before the
            first step, whose step() is called after each step, and whose result() returns the dict. Whoever
            runs it has to be able to import the module.
        options: of `stage sweep` by their names, such as {"ray-model": "exact", "limit-seconds": 60}. True: an
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
        """Those of `stage sweep` that say the same, all but where the results go.

        Raises:
            ValueError: there is no such run, or no value.
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
        """Of its options those that say how runs are done, not which."""
        return option_words(self.options, lambda name: name in EFFORT)


def bounds_of(runs: Runs) -> tuple[int, int]:
    """The first run, and the one after the last; ValueError if there is none."""
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
    """Of an axis: those in a list or the like, or the only one."""
    if isinstance(values, (list, tuple, range, np.ndarray)):
        return list(values)
    return [values]


def option_words(options: Mapping[str, Any], wanted: Callable[[str], bool]) -> list[str]:
    """Options of a program as words of a command line; None and False leave one out."""
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
