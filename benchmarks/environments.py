#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the share of vector environments in the time of their steps: all but the work of the Batch.

  tools/test -R python_package       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/environments.py -o benchmarks/results/NAME

StageVectorEnv makes steps of random actions, with episodes of the usual and of a short length that end at different
times, and with the autoreset mode SAME_STEP. In short turns, a copy of its batch makes the same calls, with the same
commands, seeds, start poses and worlds, and must reach the same states and readings. The layer is all that the copy
does not do: actions, rewards, ends and begins of episodes, observations. Its share of the wall time is the median of
all turns, so that other programs matter little; that of the processor time is from sums.

The phases are measured in further steps: calls of the batch for actions ("steps") and for new episodes ("resets"); the
task's command(), judge() and observe(); begin() of the task and of the layer; and the rest of the layer.

Prints a Markdown table of medians, with minimum and maximum in brackets. Fails unless episodes end at different times,
rewards vary, observations change in each step, and rays hit something.
"""

from __future__ import annotations

import argparse
import copy
import datetime
import gc
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import stagesim as st
from benchkit import machine
from stagesim import _core
from stagesim.env import TASKS, StageVectorEnv

CHANGING = ("reset", "teleport", "place", "step")  # methods of a batch that change its worlds
PHASES = ("steps", "resets", "command", "judge", "observe", "begin", "rest")
MOST_STEPS = 5000  # of a round
TURN = 0.003  # seconds after which the copy has its turn
ENOUGH_WORLDS = 64  # from this number on, few steps suffice to check episodes and rewards


def copied(value: Any) -> Any:
    """Returns a copy of an array of NumPy, of a tensor, or of an array on a card; other values as they are."""
    if isinstance(value, st.DeviceArray):
        import torch

        return torch.from_dlpack(value).clone()
    if isinstance(value, np.ndarray):
        return value.copy()
    return value.clone() if hasattr(value, "clone") else value


def wait_for_device(batch: st.Batch) -> None:
    """Waits until a CUDA device has done its work."""
    if isinstance(batch.pose, st.DeviceArray):
        import torch

        torch.cuda.synchronize()


class Clock:
    """Wall time and processor time in seconds since it was made."""

    def __init__(self, batch: st.Batch) -> None:
        self._batch = batch
        wait_for_device(batch)
        self._wall, self._processor = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        """Waits for a device, and returns wall time and processor time."""
        wait_for_device(self._batch)
        return time.perf_counter() - self._wall, time.process_time() - self._processor


class Recorder:
    """Notes the calls of a batch that change its worlds, so that a copy can repeat them."""

    def __init__(self, batch: st.Batch) -> None:
        self.batch = batch
        self.calls: list[tuple[str, tuple[Any, ...], dict[str, Any], Any]] = []
        self.seconds = 0.0  #: that recording took
        self._is_action = False
        for name in CHANGING:
            setattr(batch, name, self._noting(name, getattr(batch, name)))

    def begin_turn(self) -> None:
        """Forgets all calls."""
        self.calls.clear()
        self.seconds = 0.0

    def begin_action(self) -> None:
        """The next step follows commands."""
        self._is_action = True

    def stop(self) -> None:
        """Removes the recorder from the batch."""
        for name in CHANGING:
            delattr(self.batch, name)

    def _noting(self, name: str, call: Callable[..., None]) -> Callable[..., None]:
        def noting(*arguments: Any, **named: Any) -> None:
            begin = time.perf_counter()
            commands = copied(self.batch.cmd) if name == "step" and self._is_action else None
            self._is_action = False
            self.calls.append((name, tuple(map(copied, arguments)),
                               {key: copied(value) for key, value in named.items()}, commands))
            self.seconds += time.perf_counter() - begin
            call(*arguments, **named)
        return noting

    def repeat(self, other: st.Batch) -> None:
        """Makes the same calls of a copy of the batch."""
        command = other.cmd
        if isinstance(command, st.DeviceArray):
            import torch

            command = torch.from_dlpack(command)
        for name, arguments, named, commands in self.calls:
            if commands is not None:
                command[...] = commands
            getattr(other, name)(*arguments, **named)


def as_rows(value: Any) -> Any:
    """Results of a step as an array of NumPy; dictionaries and images become a row for each environment."""
    if isinstance(value, dict):
        return np.concatenate([as_rows(each).reshape(len(each), -1) for each in value.values()], axis=1)
    return np.asarray(value.cpu() if hasattr(value, "cpu") else value)


@dataclass
class Seen:
    """Sums over the results of steps, for check()."""

    steps: int = 0
    ended: int = 0  #: episodes
    most_at_once: int = 0  #: episodes that ended in one step
    rewarded: int = 0  #: rewards that are not 0
    unchanged: int = 0  #: observations of worlds that equal the ones before
    is_finite: bool = True
    last: Any = None  #: observations

    def add(self, result: tuple[Any, ...]) -> None:
        """Adds the result of a step."""
        observations, rewards, *flags = map(as_rows, result[:4])
        ended = int((flags[0] | flags[1]).sum())
        self.steps += 1
        self.ended += ended
        self.most_at_once = max(self.most_at_once, ended)
        self.rewarded += int((rewards != 0).sum())
        self.is_finite &= bool(np.isfinite(observations).all() and np.isfinite(rewards).all())
        if self.last is not None:
            self.unchanged += int((observations == self.last).all(axis=1).sum())
        self.last = observations.copy()

    def check(self, env: StageVectorEnv, limit: int) -> None:
        """Asserts that the environments have done what is measured."""
        n = env.num_envs
        expected = self.steps * n / limit
        assert self.is_finite, "found observations or rewards that are not finite"
        assert self.ended >= 0.5 * expected - 1, f"found {self.ended} ends of episodes, expected about {expected:.0f}"
        if expected >= 1 and n >= ENOUGH_WORLDS:
            assert self.ended > 0, "found no end of an episode"
            assert self.most_at_once < 0.7 * n, f"found {self.most_at_once} ends of {n} episodes at once"
        if self.steps * n >= ENOUGH_WORLDS:
            assert self.rewarded > 0, "found no reward that is not 0"
        assert self.unchanged <= 0.05 * self.steps * n, \
            f"found {self.unchanged} of {self.steps * n} observations that have not changed"
        if has_rays(env):
            self._check_rays(np.asarray(copied(env._episodes.scene.ranges)))

    def _check_rays(self, ranges: Any) -> None:
        hits = (ranges < np.nanmax(ranges)).mean() if ranges.size else 0.0
        assert hits > 0.05, f"found {hits:.1%} of the rays that hit something nearer than the range"


class Phases:
    """Measures the time of each phase of an environment's steps, without the phases within it."""

    def __init__(self, env: StageVectorEnv) -> None:
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._open: list[str] = []
        self._since = 0.0
        episodes = env._episodes
        self._wrap(env, "step", lambda: "rest")
        self._wrap(episodes, "begin", lambda: "begin")
        for name in ("command", "judge", "observe", "begin"):
            self._wrap(episodes.task, name, lambda name=name: name)
        for name in ("reset", "teleport", "step"):
            self._wrap(episodes.batch, name, lambda: "resets" if "begin" in self._open else "steps")

    def _wrap(self, owner: Any, name: str, phase: Callable[[], str]) -> None:
        call = getattr(owner, name)

        def timed(*arguments: Any, **named: Any) -> Any:
            self._enter(phase())
            try:
                return call(*arguments, **named)
            finally:
                self._leave()

        setattr(owner, name, timed)

    def _enter(self, phase: str) -> None:
        now = time.perf_counter()
        if self._open:
            self.seconds[self._open[-1]] += now - self._since
        self._open.append(phase)
        self._since = time.perf_counter()

    def _leave(self) -> None:
        now = time.perf_counter()
        self.seconds[self._open.pop()] += now - self._since
        self._since = time.perf_counter()

    def shares(self) -> dict[str, float]:
        """Shares of all time, 0 to 1."""
        whole = sum(self.seconds.values())
        return {name: seconds / whole for name, seconds in self.seconds.items()}


@dataclass
class Row:
    """Figures of a task with a number of environments and a length of episodes."""

    task: str
    environments: int
    robots: int
    limit: int  #: actions of an episode
    threads: int
    device: str
    steps: list[int] = field(default_factory=list)  #: of each round
    ended: int = 0  #: episodes
    seconds: list[float] = field(default_factory=list)  #: of the environment's steps, in each round
    batch_seconds: list[float] = field(default_factory=list)  #: of the same calls of the copy
    processor: list[float] = field(default_factory=list)  #: seconds of all threads: environment
    batch_processor: list[float] = field(default_factory=list)  #: and copy
    shares: list[float] = field(default_factory=list)  #: the layer's share of the wall time in each round, percent
    phases: dict[str, float] = field(default_factory=dict)  #: shares of a step, 0 to 1

    def add(self, steps: int, spent: list[list[float]], share: float) -> None:
        """Adds a round.

        Args:
            steps: number of steps.
            spent: seconds of wall time and processor time of the environment, and of the copy.
            share: the layer's share of the wall time in most turns, 0 to 1.
        """
        (wall, processor), (batch_wall, batch_processor) = spent
        for values, value in zip(self._rounds(), (steps, wall, batch_wall, processor, batch_processor,
                                                    100 * share)):
            values.append(value)

    def forget_first(self) -> None:
        """Removes the first round."""
        for values in self._rounds():
            del values[0]

    def _rounds(self) -> tuple[list[Any], ...]:
        return self.steps, self.seconds, self.batch_seconds, self.processor, self.batch_processor, self.shares

    def processor_shares(self) -> list[float]:
        """The layer's share of the processor time in each round, in percent."""
        return [100 * (1 - batch / whole) for batch, whole in zip(self.batch_processor, self.processor)]

    def line(self) -> str:
        """A line of the table."""
        per_step = [1e6 * seconds / steps for seconds, steps in zip(self.seconds, self.steps)]
        rate = self.environments * self.robots * 1e6 / statistics.median(per_step)
        cells = [self.task, str(self.limit), str(self.environments), str(self.robots), span(per_step, ",.0f"),
                 f"{rate:,.0f}".replace(",", " "), span(self.shares, ".1f"), span(self.processor_shares(), ".1f"),
                 *(f"{100 * self.phases[name]:.1f}" for name in PHASES)]
        return "| " + " | ".join(cells) + " |"


HEAD = ("| task | actions per episode | environments | robots | µs per step | agent-steps/s | layer, % | layer, % of "
        "processor time | " + " | ".join(f"{name}, %" for name in PHASES) + " |\n"
        + "|" + "---|" * (8 + len(PHASES)))


def span(values: Sequence[float], form: str) -> str:
    """Formats median, minimum and maximum."""
    return (f"{statistics.median(values):{form}} ({min(values):{form}} to {max(values):{form}})").replace(",", " ")


def has_rays(env: StageVectorEnv) -> bool:
    """Whether the robots have the sensor that the task reads."""
    try:
        env._episodes.scene.ranges
    except st.GoneError:
        return False
    return True


class Run:
    """The steps of an environment, and the same calls of a copy of its batch."""

    def __init__(self, task: str, environments: int, limit: int | None, options: argparse.Namespace) -> None:
        made = TASKS[task]()
        made.limit = limit or made.limit
        on_device = {"device": options.device} if options.device else {}
        self.env = StageVectorEnv(environments, task=made, threads=options.threads, autoreset_mode="SameStep",
                                  **on_device)
        self.batch: st.Batch = self.env._episodes.batch
        self.row = Row(task, environments, len(self.env.agents), made.limit, self.batch.threads, options.device or "")
        self.seen = Seen()
        self.env.action_space.seed(1)
        self._actions = [self.env.action_space.sample() for _ in range(8)]
        self._number = 0
        self.env.reset(seed=1)
        ages = self.env._episodes.scene.actions  # so that episodes end at different times
        given = np.random.default_rng(1).integers(made.limit, size=environments)
        ages[...] = given if isinstance(ages, np.ndarray) else ages.new_tensor(given)

    def step(self) -> tuple[Any, ...]:
        """Makes a step of the environment."""
        self._number += 1
        return self.env.step(self._actions[self._number % len(self._actions)])

    def warm_up(self, seconds: float) -> tuple[int, int]:
        """Returns how many steps take so many seconds, and how many an undisturbed turn has."""
        durations: list[float] = []
        while len(durations) < 3 or sum(durations) < 0.3 * seconds:
            begin = time.perf_counter()
            self.step()
            durations.append(time.perf_counter() - begin)
        steps = round(seconds * len(durations) / sum(durations))
        return min(MOST_STEPS, max(2, steps)), max(1, round(TURN / min(durations)))

    def measure(self, seconds: float, repeats: int) -> Row:
        """Measures rounds, in turns with those of the copy, and the phases; checks what happened."""
        steps, turn = self.warm_up(seconds)
        alone = copy.deepcopy(self.batch)
        self._arrays(alone)  # which are filled in each step from now on
        recorder = Recorder(self.batch)
        for steps_of_round in (min(steps, 10), *[steps] * repeats):
            self._round(recorder, alone, steps_of_round, turn)
        self.row.forget_first()  # because the first steps of a copy allocate memory
        recorder.stop()
        self.check_copy(alone)
        self.seen.check(self.env, self.row.limit)
        self.row.ended = self.seen.ended
        phases = Phases(self.env)
        for _ in range(steps):
            self.step()
        self.row.phases = phases.shares()
        return self.row

    def _round(self, recorder: Recorder, alone: st.Batch, steps: int, turn: int) -> None:
        """Makes steps in turns with the same calls of the copy, so that other load affects both."""
        shares = []
        spent = np.zeros((2, 2))  # of the environment and of the copy: wall time and processor time
        gc.collect()
        for begin in range(0, steps, turn):
            results = []  # are freed after each turn, as learners do
            recorder.begin_turn()
            clock = Clock(self.batch)
            for _ in range(min(turn, steps - begin)):
                recorder.begin_action()
                results.append(self.step()[:4])
            whole = np.array(clock.read()) - recorder.seconds
            clock = Clock(alone)
            recorder.repeat(alone)
            batch = np.array(clock.read())
            spent += whole, batch
            shares.append(1 - batch[0] / whole[0])
            for result in results:
                self.seen.add(result)
        self.row.add(steps, spent.tolist(), float(np.median(shares)))

    def check_copy(self, alone: st.Batch) -> None:
        """Asserts that the copy has done the same."""
        assert alone.state_hashes() == self.batch.state_hashes(), "found other states in the copy of the batch"
        arrays, others = self._arrays(self.batch), self._arrays(alone)
        for name in arrays:
            one, other = np.asarray(copied(arrays[name])), np.asarray(copied(others[name]))
            assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), f"found another {name!r} in the copy"

    def _arrays(self, batch: st.Batch) -> dict[str, Any]:
        """The arrays of a batch that the environment and its task read."""
        arrays = {name: getattr(batch, name) for name in self.batch._views}
        return {**arrays, self.env.task.ranges: batch.array(self.env.task.ranges)} if has_rays(self.env) else arrays


def conditions(options: argparse.Namespace) -> dict[str, Any]:
    """When, where and how the figures are measured."""
    here = machine.this_machine(())
    options_told = {name: getattr(options, name) for name in ("seconds", "repeats", "threads", "device")}
    return {"date": datetime.date.today().isoformat(), "commit": machine.commit(), "cpu": here.cpu, "cores": here.cores,
            **options_told}


def write(folder: Path, rows: Sequence[Row], facts: dict[str, Any]) -> None:
    """Writes environments.json and environments.md."""
    folder.mkdir(parents=True, exist_ok=True)
    content = {**facts, "rows": [asdict(row) for row in rows]}
    (folder / "environments.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    head = f"""<!-- SPDX-License-Identifier: GPL-2.0-or-later -->
# The share of the environment layer

Made by `benchmarks/environments.py` on {facts['date']}: {facts['cpu']}, {facts['cores']} cores, commit
{facts['commit']}; {facts['repeats']} rounds of about {facts['seconds']:g} s, {facts['threads']} threads{
    f", device {facts['device']}" if facts['device'] else ''}. Its head comment explains the columns.

"""
    (folder / "environments.md").write_text(head + "\n".join([HEAD, *(row.line() for row in rows)]) + "\n",
                                            encoding="utf-8")


def numbers(text: str) -> list[int]:
    """Parses whole numbers separated by commas, each at least 1."""
    found = [int(word) for word in text.split(",")]
    if min(found) < 1:
        raise argparse.ArgumentTypeError(f"found {min(found)}, expected 1 or more")
    return found


def rows_of(options: argparse.Namespace) -> Iterator[Row]:
    """Measures each combination."""
    for task in options.task or TASKS:
        for limit in (None, options.limit):
            for environments in options.environments:
                yield Run(task, environments, limit, options).measure(options.seconds, options.repeats)
                gc.collect()


def options_of(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", action="append", choices=sorted(TASKS), help="only this task; can be repeated")
    parser.add_argument("--environments", type=numbers, default=[1, 8, 64, 512, 4096, 65536],
                        help="numbers of environments, separated by commas (default 1,8,64,512,4096,65536)")
    parser.add_argument("--limit", type=int, default=20, help="actions of short episodes (default %(default)s)")
    parser.add_argument("--threads", type=int, default=_core.count_processors(), help="(default: all processors)")
    parser.add_argument("--device", help="as in stagesim.Batch (default: the host makes the steps)")
    parser.add_argument("--seconds", type=float, default=0.5, help="of each round (default %(default)s)")
    parser.add_argument("--repeats", type=int, default=3, help="rounds (default %(default)s)")
    parser.add_argument("-o", "--output", type=Path, help="folder to write environments.json and .md to")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the program; returns the exit status."""
    options = options_of(arguments)
    facts = conditions(options)
    rows: list[Row] = []
    print(HEAD, flush=True)
    try:
        for row in rows_of(options):
            rows.append(row)
            print(row.line(), flush=True)
            if options.output:
                write(options.output, rows, facts)
    except AssertionError as error:
        print(f"environments.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
