# SPDX-License-Identifier: GPL-2.0-or-later
"""Names for programs that know Unicode alone."""

from __future__ import annotations


def printable(name: str) -> str:
    r"""The name, where bytes that are not UTF-8 are written as \xff and the like.

    Names in world files, and of files, may have such bytes. Python holds them as lone surrogates (PEP 383, the error
    handler "surrogateescape"), which neither JSON, Foxglove nor ROS can carry.
    """
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
