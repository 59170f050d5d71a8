#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages go through libstage/messages. All other places that print in the library or in the program are
listed here with the reason."""

from __future__ import annotations

import re
import unittest
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ["libstage", "libstage_cl", "tools/stage"]

PRINTS = re.compile(
    r"(?<![\w.])(?:std::)?(?:v?f?printf|f?puts|f?putc|putchar|fwrite|perror|psignal|syslog)\s*\("
    r"|\bstd::c(?:out|err|log)\b|\bSTD(?:OUT|ERR)_FILENO\b|\bPRINT_(?:ERR|WARN|MSG|DEBUG)\d?\s*\(")

# Places that print by request of a client or an option, with printable names, and the few that cannot
# use a log: their number in each file, and the reason.
ALLOWED = {
    "libstage/pictures/color.cc": (1, "Print(), of numbers"),
    "libstage/geometry/geometry.cc": (5, "Print(), of numbers"),
    "libstage/gui/offscreen/video.cc": (2, "where the output of ffmpeg goes"),
    "libstage/messages/assert.cc": (1, "the default handler of assertions, which ends the program"),
    "libstage/messages/report.cc": (2, "this is where messages go; the macros for clients"),
    "libstage/models/types/bumper.cc": (3, "Print()"),
    "libstage/models/types/lightsensor.cc": (3, "Print()"),
    "libstage/models/log_entry.cc": (1, "Print(), of numbers"),
    "libstage/include/models/messages.hh": (36, "the macros themselves, for clients"),
    "libstage/models/model_tree.cc": (1, "Print()"),
    "libstage/models/power_pack.cc": (1, "Print(), of numbers"),
    "libstage/models/types/ranger.cc": (6, "Print()"),
    "libstage_cl/driver_watch.cc": (1, "in a signal's handler, or beside a thread that hangs"),
    "tools/stage/console.cc": (4, "the library's progress: [Loading FILE] and the like"),
    "tools/stage/main.cc": (2, "what options ask for; and there is no memory for a message of that"),
    "tools/stage/process.cc": (8, "PrintWhole, for what options ask for; OutputToError, what --explain prints "
                               "while it loads"),
    "tools/stage/progress.cc": (1, "whether standard error is a terminal"),
    "tools/stage/report.cc": (1, "--stats"),
    "tools/stage/status_line.cc": (2, "the line of --progress, which is written over again and again"),
    "tools/stage/sweep/options.cc": (1, "whether standard error is a terminal"),
    "tools/stage/sweep/worker_process.cc": (3, "between fork() and exec()"),
}


def code_of(path: Path) -> str:
    """The text of a source without comments and strings."""
    text = path.read_text()
    text = re.sub(r'"(?:\\.|[^"\\\n])*"', '""', text)
    text = re.sub(r"//[^\n]*", "", text)
    return re.sub(r"/\*.*?\*/", "", text, flags=re.S)


def sources() -> Iterator[Path]:
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".cc", ".hh"):
                yield path


class MessagesRuleTest(unittest.TestCase):
    def test_the_pattern_finds_what_prints(self) -> None:
        for text in ['std::printf("x")', "fprintf(stderr", "std::cerr << 1", "  puts(s)", 'PRINT_ERR1("a", b)',
                     "std::fwrite(a, 1, 2, f)", "STDERR_FILENO"]:
            self.assertRegex(text, PRINTS)
        for text in ["std::snprintf(a", "format(printf, 1, 2)", "vsnprintf(t", "x.puts(s)", "Reports(1)"]:
            self.assertNotRegex(text, PRINTS)

    def test_nothing_prints_but_what_is_listed(self) -> None:
        found = {}
        for path in sources():
            count = len(PRINTS.findall(code_of(path)))
            if count:
                found[str(path.relative_to(ROOT))] = count
        listed = {name: count for name, (count, _) in ALLOWED.items()}
        self.assertEqual(found, listed,
                         "messages go through messages::Report() and Warn(); see messages/report.hh")


if __name__ == "__main__":
    unittest.main()
