# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes files completely or not at all, for the scripts in this folder. libstage/files/whole_file.hh does
the same for programs."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from pathlib import Path
from typing import Callable


def write_whole(path: Path, content: bytes, is_ours: Callable[[bytes], bool] | None = None) -> None:
    """Create or replace a file atomically. Keeps a link and the file's mode. Raises OSError; EEXIST if the
    present content is not ours."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        mode = stat.S_IFREG | 0o666 & ~current_umask()
    else:
        check_replaceable(path, is_ours)
    if not stat.S_ISREG(mode):
        path.write_bytes(content)  # a pipe or device must not be replaced
        return
    place = path.resolve()
    handle, unfinished = tempfile.mkstemp(prefix=".stage-", dir=place.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            os.fchmod(file.fileno(), stat.S_IMODE(mode))
            file.write(content)
        os.replace(unfinished, place)
    except BaseException:
        os.unlink(unfinished)
        raise


def check_replaceable(place: Path, is_ours: Callable[[bytes], bool] | None) -> None:
    """Raise the OSError that write_whole() would raise because of the present content."""
    mode = place.stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(place))
    if not os.access(place, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(place))
    if stat.S_ISREG(mode) and is_ours is not None:
        present = place.read_bytes()
        if present and not is_ours(present):
            raise FileExistsError(errno.EEXIST, "it exists and holds something else", str(place))


def current_umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
