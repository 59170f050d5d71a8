# SPDX-License-Identifier: GPL-2.0-or-later
"""Names that are not UTF-8, which Python holds as lone surrogates, are converted to printable text."""

from __future__ import annotations

import json
import os

import pytest
from stagesim.live.messages import packed, unpacked
from stagesim.ros.names import SCHEMES, joined
from stagesim.text import printable


@pytest.mark.parametrize(("name", "shown"), [
    (b"r0", "r0"), (b"\xc3\xa9", "\u00e9"), (b"r\xff", r"r\xff"), (b"\x80\x81", r"\x80\x81"), (b"\xc3", r"\xc3"),
    (b"\xed\xa0\x80", r"\xed\xa0\x80"), (b"a\xf0\x9f\xa4\x96", "a\U0001f916"), (b"", "")])
def test_printable_names_survive_every_encoding(name: bytes, shown: str) -> None:
    text = printable(os.fsdecode(name))
    assert text == shown
    text.encode()  # strict: raises for surrogates
    assert json.loads(json.dumps(text)) == shown and unpacked(packed({"name": text}))[0] == {"name": shown}
    assert printable(text) == text


def test_names_of_ros_have_the_signs_that_ros_allows() -> None:
    names = [os.fsdecode(name) for name in (b"r\xff", b"\xff", b"\x80", b"r", b"a\xff\xfeb")]
    found = SCHEMES["stage_ros2"].prefixes(names, False)
    assert found == ["r", "robot", "robot_2", "r_2", "a_b"]
    assert all(joined(name, "odom").isascii() for name in found)
