# SPDX-License-Identifier: GPL-2.0-or-later
"""What command lines that offer the page have in common."""

from __future__ import annotations

import argparse
import os
import webbrowser
from collections.abc import Sequence


def port_of(text: str) -> int:
    """A port; 0: any that is free."""
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a port, from 0 to 65535")
    return int(text)


def with_port(words: Sequence[str], option: str, default: int) -> list[str]:
    """The words, where the option has that port unless a number follows: argparse would take the world for it."""
    after = [*words[1:], ""]
    return [f"{option}={default}" if word == option and not next_.isdecimal() else word
            for word, next_ in zip(words, after)]


def with_device(words: Sequence[str]) -> list[str]:
    """The words, where --opencl names its device after a = alone, as it does with `stage`."""
    return ["--opencl=" if word == "--opencl" else word for word in words]


def open_page(url: str) -> None:
    """Opens it in a browser, where there is a display."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(url)
