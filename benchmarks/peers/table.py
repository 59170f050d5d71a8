# SPDX-License-Identifier: GPL-2.0-or-later
"""The table in Markdown, and all figures as JSON."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Sequence
from pathlib import Path

from benchkit.machine import commit, this_cpu, usable_cores

from .checks import ALIKE, ERROR, SAME_HITS
from .rows import Row, median

HEADER = ("scene", "agents", "rays", "environments", "simulator", "agent-steps/s", "rays/s", "stagesim is faster by",
          "µJ per agent-step", "rays that hit", "remarks")
BUSY = 0.1  # processors that other programs may use; with more, figures are provisional

EXPLANATION = f"""\
Medians, with minimum and maximum of the rounds in brackets; the ratio is that of the same round, and below 1 stagesim
is slower. Before it is measured, each simulator runs episodes. Of the rays that hit something according to the lidar
or to exact geometry, {SAME_HITS:.0%} must do so according to both, and their ranges may differ by {1000 * ERROR:g} mm
(median). The fraction of rays that hit must be in the expected range, and that of two simulators may differ by
{ALIKE:.0%} and three standard errors. Agents must move, touch each other and start again, and rewards must be finite
and vary. A row that fails has no figures.

"Provisional" are figures of a machine that was busy with other programs. Then the agent-steps per second of processor
time say more, if there is one thread; with several, those of PyTorch wait for each other.
"""


def span(values: Sequence[float]) -> str:
    """Formats median, minimum and maximum."""
    if not values:
        return "–"
    return f"{thousands(median(values))} ({thousands(min(values))} to {thousands(max(values))})"


def thousands(value: float) -> str:
    """Formats a whole number with gaps between thousands."""
    return f"{value:,.0f}".replace(",", " ")


def ratio(values: Sequence[float]) -> str:
    """Formats the median of ratios with three digits."""
    if not values:
        return "–"
    digits = 2 - math.floor(math.log10(median(values)))
    return f"{median(values):.{max(0, digits)}f}"


def remarks(row: Row) -> str:
    """Why a row has no figures, or what a reader must know about it."""
    if row.missing:
        return f"not installed: {row.missing}"
    if row.failures:
        return "FAILED: " + "; ".join(row.failures)
    return "; ".join(part for part in (row.note, disturbance(row)) if part)


def disturbance(row: Row) -> str:
    """Describes how other programs used the machine, and the speed in processor time, which suffers less from that."""
    if not is_disturbed(row):
        return ""
    units = "agent-steps" if row.agents else "rays"
    times = f", stagesim {ratio(row.processor_ratios)} times as many" if row.processor_ratios else ""
    speed = thousands(median(row.per_processor))
    return f"provisional: others used {max(row.others):.1f} processors; {speed} {units} per processor-second{times}"


def is_disturbed(row: Row) -> bool:
    """Tells whether other programs used the machine during its measurements."""
    return bool(row.others) and max(row.others) > BUSY


def cells(row: Row) -> list[str]:
    """The cells of a line."""
    name = f"{row.title} {row.version}".strip() + (f", {row.device}" if row.device != "cpu" else "")
    figures = ["–"] * 4
    if row.measured:
        energy = f"{median(row.microjoules):.3g} ({row.energy})" if row.microjoules and row.agents else row.energy
        figures = [span(row.agent_steps), span(row.ray_rates), ratio(row.ratios), energy]
    hits = "–" if row.hits is None else f"{row.hits:.1%}"
    if row.sight is not None:
        hits += f" ({row.sight.expected[0]:.1%} to {row.sight.expected[1]:.1%} expected)"
    sizes = [str(row.agents or "–"), str(row.rays), str(row.envs) if row.agents else "–"]
    return [row.scene, *sizes, name, *figures, hits, remarks(row)]


def line(row: Row) -> str:
    """A line of the table."""
    return "| " + " | ".join(cells(row)) + " |"


def head() -> str:
    """The first lines of the table."""
    return "| " + " | ".join(HEADER) + " |\n" + "|---" * len(HEADER) + "|"


def conditions(options: dict[str, object]) -> dict[str, object]:
    """The circumstances of the figures."""
    return {"date": time.strftime("%Y-%m-%d"), "commit": commit(), "cpu": this_cpu(), "cores": usable_cores(),
            **options}


def finite(value: object) -> object:
    """Replaces numbers that JSON does not have by None."""
    if isinstance(value, dict):
        return {key: finite(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write(folder: Path, rows: Sequence[Row], facts: dict[str, object]) -> None:
    """Writes peers.md and peers.json."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = {**facts, "rows": [finite(row.as_json()) for row in rows]}
    (folder / "peers.json").write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    made = (f"Made by `benchmarks/peers` on {facts['date']}: {facts['cpu']}, {facts['cores']} cores, commit "
            f"{facts['commit']}; {facts['repeats']} rounds of at least {facts['seconds']:g} s, {facts['threads']} "
            "threads.")
    text = "\n".join(["<!-- SPDX-License-Identifier: GPL-2.0-or-later -->", "# stagesim and other simulators", "", made,
                      "", EXPLANATION, head(), *map(line, rows), ""])
    (folder / "peers.md").write_text(text, encoding="utf-8")
