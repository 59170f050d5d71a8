# SPDX-License-Identifier: GPL-2.0-or-later
"""Logs: MCAP files of ROS 2 messages with what the robots of a world sense, are told, touch and do."""

from __future__ import annotations

import math
import os
import weakref
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from . import _checks, _core
from .errors import StageError

COMPRESSIONS, RANGES = ("lz4", "zstd", "none"), ("rep117", "stage")


class Log:
    """A log that is being written: see World.log(), Batch.log() and docs/recording.md.

    It ends with close(), at the end of a `with` block, when nothing refers to it any more, or with its world: when
    that is closed, reset, or restored to an earlier time. A log does not change the run.
    """

    def __init__(self, files: Sequence[str], cores: Sequence[_core.RunLog | _core.BatchLog]) -> None:
        self.files = tuple(files)  #: the files, one for each logged world
        self._cores = list(cores)
        self._end = weakref.finalize(self, _forget, self._cores)

    def close(self) -> None:
        """Completes the files. Closing a closed log has no effect.

        Raises:
            StageError: a file can't be written, or another thread is using the world; then the log goes on.
        """
        if not self._end.alive:
            return
        failure = None
        for core in self._cores:
            try:
                core.finish()
            except StageError as error:
                failure = failure or error
        if failure is not None:
            raise failure
        self._end.detach()

    @property
    def closed(self) -> bool:
        """True if the files are complete."""
        return not self._end.alive

    def __enter__(self) -> Log:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        more = f" and {len(self.files) - 1} more files" if len(self.files) > 1 else ""
        return f"<Log {self.files[0]!r}{more}{', closed' if self.closed else ''}>"


def _forget(cores: Sequence[_core.RunLog | _core.BatchLog]) -> None:
    """Completes files to which nothing refers. If another thread is using the world, it does so afterwards."""
    for core in cores:
        core.finish_when_free()


def started(starts: Sequence[tuple[str | os.PathLike[str], Callable[..., Any]]], every: float,
            models: str | Iterable[str] | None, compression: str | None, ranges: str) -> Log:
    """Starts a log of several files: each with a function that starts one. Raises as World.log() does."""
    arguments = _arguments(every, models, compression, ranges)
    files = [os.fspath(file) for file, _ in starts]
    cores: list[Any] = []
    try:
        for file, (_, start) in zip(files, starts):
            if not isinstance(file, str) or not file:
                raise ValueError(f"found {_checks.shown(file)} as the file of a log, expected the name of a file")
            cores.append(start(file, *arguments))
    except BaseException:
        _forget(cores)
        raise
    return Log(files, cores)


def _arguments(every: float, models: str | Iterable[str] | None, compression: str | None,
               ranges: str) -> tuple[int, list[str], str, bool]:
    """The arguments of start_log() after the file. Raises TypeError or ValueError."""
    seconds = float(every)
    if not (math.isfinite(seconds) and 0 <= seconds <= 1e12):
        raise ValueError(f"found {every!r} as every, expected a number of seconds, 0 or more")
    names = [] if models is None else [models] if isinstance(models, str) else list(models)
    for name in names:
        if not isinstance(name, str):
            raise TypeError(f"found {_checks.shown(name)} in models, expected names or patterns with * and ?")
    if models is not None and not names:
        raise ValueError("found no names in models, expected some, or None for all robots")
    if compression is not None and compression not in COMPRESSIONS:
        raise ValueError(f"found the compression {_checks.shown(compression)}, expected {', '.join(COMPRESSIONS)} or None")
    if ranges not in RANGES:
        raise ValueError(f"found {_checks.shown(ranges)} as ranges, expected {' or '.join(RANGES)}")
    return round(seconds * 1e6), names, compression or "", ranges == "rep117"
