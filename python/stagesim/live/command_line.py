# SPDX-License-Identifier: GPL-2.0-or-later
"""Common functions of the command lines that show the page."""

from __future__ import annotations

import argparse
import os
import webbrowser
from collections.abc import Sequence


def port_of(text: str) -> int:
    """Parses a port; 0: any free port. Raises ArgumentTypeError if it is invalid."""
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a port, from 0 to 65535")
    return int(text)


def with_port(words: Sequence[str], option: str, default: int) -> list[str]:
    """Adds the default port to the option unless a number follows, so that argparse doesn't consume the world."""
    after = [*words[1:], ""]
    return [f"{option}={default}" if word == option and not next_.isdecimal() else word
            for word, next_ in zip(words, after)]


def open_page(url: str) -> None:
    """Opens the page in a browser if there is a display."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(url)
