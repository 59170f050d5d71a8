# SPDX-License-Identifier: GPL-2.0-or-later
"""Files that are written completely or not at all, and that replace only earlier files of their kind."""

from __future__ import annotations

import os
import tempfile

#: Beginning of the comment on the first line of worlds that were made.
WORLD_HEAD = "Made by stage import"
#: First lines of maps that were made: of map.yaml, and of its picture.
YAML_HEAD = b"# Made by stage export map"
PICTURE_HEAD = b"P5\n# Made by stage export map"


def write(path: str, content: bytes, head: bytes, kind: str) -> None:
    """Writes a file.

    Args:
        path: the file.
        content: its content.
        head: beginning of a file that may be replaced.
        kind: describes such files in the message.

    Raises:
        ValueError: the file exists and is another one.
        OSError: it can't be written.
    """
    if os.path.lexists(path):
        with open(path, "rb") as present:
            if present.read(len(head)) not in (head, b""):
                raise ValueError(f"{path}: found another file, expected a new name or {kind}")
    handle, made = tempfile.mkstemp(prefix=".stage_", dir=os.path.dirname(path) or ".")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(made, 0o666 & ~mask)
        os.replace(made, path)
    except BaseException:
        os.unlink(made)
        raise
