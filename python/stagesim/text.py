# SPDX-License-Identifier: GPL-2.0-or-later
"""Names for programs that accept only valid Unicode."""

from __future__ import annotations


def printable(name: str) -> str:
    r"""Returns the name with bytes that are not UTF-8 escaped as \xff and the like.

    Names of files, and names in world files, may contain such bytes. Python holds them as lone surrogates (PEP 383,
    the error handler "surrogateescape"), which JSON, Foxglove and ROS cannot transport.
    """
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
