# SPDX-License-Identifier: GPL-2.0-or-later
"""The report of a series: Markdown with tables and plots, including the cases in which OpenCL is
slower."""

from __future__ import annotations

import json
import math
from pathlib import Path

from benchkit.inference import LEVEL, Summary, summary
from benchkit.report import number, picture, spread, table
from benchkit.series.analysis import LARGE, Series, differences
from benchkit.series.breakeven import BreakEven
from benchkit.series.labels import (PAPER, PAPER_FASTER, PAPER_ROBOTS, backend_name,
                                    short_device)
from benchkit.series.nearness import Nearness, nearness

MACHINE_FILE = "machine.json"
REPORT_FILE = "report.md"


def values(series: Series, column: str) -> list[str]:
    """Distinct values of a text column."""
    return sorted({str(getattr(record, column)) for record in series.measured})


# Measured runs and machines.

def machine_rows(series: Series, facts: list[dict]) -> list[tuple[str, str]]:
    """Facts about the machines, or only those in the raw file if the others are lost."""
    rows = [("machine", "; ".join(values(series, "machine")))]
    for fact in facts:
        virtual = ", virtual machine" if fact.get("virtual") else ""
        governor = f", governor {fact['governor']}" if fact.get("governor") else ""
        rows.append(("processor", f"{fact['cpu']} ({fact['architecture']}), {fact['cores']} cores, "
                                  f"{fact['memory_gib']} GiB{virtual}{governor}"))
        rows += [("OpenCL device", f"{d['kind']}: {d['name']} ({d['platform']}, {d['version']}, "
                                   f"{d['compute_units']} compute units, {d['megabytes']} MiB)")
                 for d in fact["devices"]]
        if not fact["devices"]:
            rows.append(("OpenCL device", "none"))
    return rows


def measured_section(series: Series, facts: list[dict]) -> list[str]:
    dates = sorted(record.date for record in series.measured)
    loads = [record.load_average for record in series.measured
             if not math.isnan(record.load_average)]
    rows = machine_rows(series, facts) + [
        ("system", "; ".join(values(series, "system"))),
        ("commit", ", ".join(values(series, "commit"))),
        ("build (fingerprint)", ", ".join(values(series, "program"))),
        ("measured", f"{dates[0]} to {dates[-1]}"),
        ("runs", f"{len(series.measured)}, {repeats_text(series)} of each"),
        ("form", form_text(series)),
        ("energy meter", meter_text(series)),
        ("load average before a run", f"{min(loads):.1f} to {max(loads):.1f}" if loads else ""),
    ]
    return ["## What was measured", "", *table(("", ""), rows)]


def repeats_text(series: Series, *backends: str) -> str:
    """Number of repeats of the given backends, or of all."""
    fewest, most = series.repeats(*backends)
    number_text = str(most) if fewest == most else f"{fewest} to {most}"
    return f"{number_text} repeat{'' if number_text == '1' else 's'}"


def form_text(series: Series) -> str:
    """The form of the series and the simulated seconds."""
    seconds = [record.simulated_seconds for record in series.measured]
    span = f"{min(seconds):g} to {max(seconds):g}" if min(seconds) < max(seconds) else \
        f"{seconds[0]:g}"
    real = sorted(record.wall_seconds for record in series.measured)
    return (f"{'/'.join(values(series, 'form'))}: {span} simulated seconds per run, which took "
            f"{number(real[0])} to {number(real[-1])} real seconds, median "
            f"{number(real[len(real) // 2])}")


def meter_text(series: Series) -> str:
    if not series.has("r_epss"):
        return "no meter on this machine: no r_EPSS"
    return "; ".join(sorted({f"{r.meter}, scope: {r.scope or 'unknown'}"
                             for r in series.measured if not math.isnan(r.r_epss)}))


def warnings(series: Series) -> list[str]:
    """Warnings to be read before the figures."""
    found = []
    for difference in differences(series.records):
        hashes = "; ".join(f"`{state}`: {', '.join(labels)}"
                           for state, labels in sorted(difference.hashes.items()))
        found.append(f"**STATE HASHES DIFFER**: {difference.world}, {difference.population} "
                     f"robots, {difference.simulated_seconds:g} simulated seconds: {hashes}. These "
                     "runs did not compute the same results, so their figures can't be compared.")
    for record in series.failures():
        found.append(f"**Run failed**: {record.purpose}, {record.world}, {record.population} "
                     f"robots, {record.backend}, repeat {record.repeat}: {record.error}")
    for column in ("commit", "program", "machine"):
        different = values(series, column)
        if len(different) > 1:
            found.append(f"**Mixed**: the runs differ in {column} ({'; '.join(different)}); their "
                         "figures are combined nevertheless.")
    changed = [commit for commit in values(series, "commit") if commit.endswith("+")]
    if changed:
        found.append(f"The working tree had uncommitted changes ({', '.join(changed)}).")
    if "short" in values(series, "form"):
        found.append("Short form: each run takes only one or two seconds. This is enough for "
                     "trends; use `--long` for figures to be published.")
    slowed = [record for record in series.measured if record.throttled]
    if slowed:
        found.append(f"**The chip was throttled** in {len(slowed)} of {len(series.measured)} runs, "
                     "which are listed in \"Heat and clock\". Their figures are those of a slower "
                     "chip.")
    found += too_few_repeats(series)
    return [f"> {text}\n>" for text in found[:-1]] + [f"> {text}" for text in found[-1:]] + [""] \
        if found else []


def too_few_repeats(series: Series) -> list[str]:
    few = [label for label in series.backends if series.repeats(label)[0] < 3]
    if len(few) == len(series.backends):
        return [f"Only {repeats_text(series)} of each run: the spreads mean little."]
    return [f"Only {repeats_text(series, label)} of each run of {backend_name(series, label)}: its "
            "spreads mean little." for label in few]


# Results.

def column_tables(series: Series, column: str, unit: str) -> list[str]:
    """A table of the figure for each world: populations by backends."""
    lines = []
    for world in series.worlds:
        rows = []
        for n in series.populations(world):
            rays = [series.column(world, n, b, "rays_per_step") for b in series.backends]
            known = next((r for r in rays if r is not None), None)
            rows.append([str(n), number(known.median) if known else ""]
                        + [spread(series.column(world, n, b, column)) for b in series.backends])
        lines += [f"{world}, {unit}:", ""]
        lines += table(["robots", "rays per step"] + [backend_name(series, b)
                                                    for b in series.backends], rows)
    return lines


def speed_section(series: Series, plots: dict[str, Path]) -> list[str]:
    return ["## r_ACC: simulation speed", "",
            "Robots times simulated seconds per real second: median of the repeats, with minimum "
            "and maximum.", "",
            *picture(plots, "r_acc", "r_ACC against the population"),
            *column_tables(series, "r_acc", "robot s / real s")]


def energy_section(series: Series, plots: dict[str, Path]) -> list[str]:
    lines = ["## r_EPSS: energy per simulated robot second", ""]
    if not series.has("r_epss"):
        return lines + ["There is no meter on this machine, so there are no figures. "
                        "`benchmarks/series --help` explains `--meter`.", ""]
    share = series.start_up_share()
    if share is not None:
        lines += ["The meter runs as long as the program does, including loading: "
                  f"{share.median:.0%} of this time (median; {share.least:.0%} to "
                  f"{share.greatest:.0%}) is spent outside of steps.", ""]
    without = [record for record in series.measured if math.isnan(record.r_epss)]
    if without:
        reasons = sorted({record.notes for record in without})
        lines += [f"{len(without)} of {len(series.measured)} runs have no figure "
                  f"({'; '.join(reasons)}).", ""]
    return lines + [*picture(plots, "r_epss", "r_EPSS against the population"),
                    *column_tables(series, "r_epss", f"J / robot s, scope: {series.scopes}")]


def relative_section(series: Series, plots: dict[str, Path]) -> list[str]:
    """OpenCL relative to the host, in speed and energy."""
    lines = ["## OpenCL relative to the host", ""]
    if not series.accelerated or not series.bases:
        return lines + ["Nothing to compare: runs with OpenCL and on the host are needed.", ""]
    lines += ["Ratios of r_ACC within a repeat; more than 1 means that OpenCL is faster. Lines "
              f"show the known figures of {PAPER}: on an Exynos board with a Mali GPU, OpenCL was "
              f"up to 82 % faster ({PAPER_FASTER:g} times) and needed 30 % less energy; below "
              f"about {PAPER_ROBOTS} robots it was slower. The worlds and the board differ from "
              "those of this series.", ""]
    for base in series.bases:
        if not any(b != base for b in series.accelerated):
            continue
        lines += picture(plots, f"relative-{base}", f"r_ACC relative to {base}")
        lines += relative_tables(series, base, "r_acc", "r_ACC")
        lines += picture(plots, f"relative-energy-{base}", f"r_EPSS relative to {base}")
        if series.has("r_epss"):
            lines += relative_tables(series, base, "r_epss", "r_EPSS (less is better)")
    return lines + loss_lines(series)


def relative_tables(series: Series, base: str, column: str, what: str) -> list[str]:
    lines = []
    labels = [b for b in series.backends if b not in (base, "host1")]
    for world in series.worlds:
        rows = [[str(n), *(spread(series.relative(world, n, b, base, column)) for b in labels)]
                for n in series.populations(world, base)]
        lines += [f"{world}, {what} relative to {backend_name(series, base)}:", ""]
        lines += table(["robots"] + [backend_name(series, b) for b in labels], rows)
    return lines


def loss_lines(series: Series) -> list[str]:
    """Describes the cases in which OpenCL did not pay."""
    losses = series.losses()
    lines = ["### Where OpenCL loses", ""]
    if not losses:
        return lines + ["Nowhere in the measured range.", ""]
    lines += ["Populations in which OpenCL is slower in the median; in brackets if the repeats "
              "disagree.", ""]
    rows = []
    for base in series.bases:
        for backend in series.accelerated:
            for world in series.worlds:
                mine = [loss for loss in losses
                        if (loss.base, loss.backend, loss.world) == (base, backend, world)]
                if not mine:
                    continue
                worst = min(mine, key=lambda loss: loss.ratio.median)
                rows.append([world, backend_name(series, backend), backend_name(series, base),
                             ", ".join(str(loss.population) if loss.ratio.greatest < 1 else
                                       f"({loss.population})" for loss in mine),
                             f"{worst.ratio.median:.2f} at {worst.population}"])
    return lines + table(["world", "backend", "slower than", "with robots", "worst r_ACC ratio"],
                         rows)


def averages_section(series: Series, plots: dict[str, Path]) -> list[str]:
    lines = [f"## Averages over {LARGE} robots and more", ""]
    worlds = [world for world in series.worlds if series.large_populations(world)]
    if not worlds:
        return lines + [f"No population of {LARGE} robots or more was measured with all "
                        "backends.", ""]
    lines += ["Arithmetic means of r_ACC, and geometric means of the ratios, over the populations "
              "that were measured with all backends: median of the repeats, with minimum and "
              "maximum.", "",
              *picture(plots, "averages", "Averages"), *picture(plots, "averages-energy", "Energy")]
    rows = []
    for world in worlds:
        for b in series.backends:
            row = [world, backend_name(series, b), spread(series.average(world, b))]
            row += [spread(series.average_relative(world, b, base)) for base in series.bases]
            if series.has("r_epss"):
                row.append(spread(series.average(world, b, "r_epss")))
            rows.append(row)
        lines.append(f"{world}: {', '.join(map(str, series.large_populations(world)))} robots.")
    head = ["world", "backend", "mean r_ACC"]
    head += [f"times {backend_name(series, base)}" for base in series.bases]
    if series.has("r_epss"):
        head.append(f"mean r_EPSS (J / robot s, {series.scopes})")
    return lines + ["", *table(head, rows)]


# Break-even.

def bound_text(value: float, below: str, above: str) -> str:
    if math.isinf(value):
        return above if value > 0 else below
    return rough(value)


def rough(value: float) -> str:
    """Rounds an interpolated figure, which is less exact than measured ones."""
    return number(float(f"{value:.3g}"))


def break_even_text(found: BreakEven | None) -> tuple[str, str, str]:
    """Rays, interval and robots as text, also for results outside the measured range."""
    if found is None:
        return "too few populations", "", ""
    bounds = ""
    if not math.isnan(found.low):
        bounds = " to ".join(bound_text(bound, "below the range", "none in the range")
                             for bound in (found.low, found.high))
        if math.isinf(found.low) and found.low == found.high:
            bounds = bound_text(found.low, "below the range", "none in the range")
    if found.found:
        rays = rough(found.rays)
        if found.crossings > 1:
            rays += f" (the last of {found.crossings} crossings)"
        return rays, bounds, rough(found.robots)
    if found.rays < 0:
        return (f"below the range: faster already at {number(found.range_low)}", bounds, "")
    if found.wins:
        wins = ", ".join(number(rays) for rays in found.wins)
        return (f"none in the range: slower at the upper end, {number(found.range_high)}; faster "
                f"only at {wins}", bounds, "")
    return f"none in the range: slower up to {number(found.range_high)}", bounds, ""


def break_even_section(series: Series) -> list[str]:
    lines = ["## Break-even: rays per step from which the device is faster", ""]
    if not series.devices or not series.bases:
        return lines + ["There are no runs with every step on a device, or no runs on the host.", ""]
    lines += [f"Interpolated between populations on logarithmic axes. The interval ({LEVEL:.0%}) "
              "is estimated from the scatter of the repeats by resampling; with few repeats it is "
              "inexact.", ""]
    rows = [[world, backend_name(series, device), backend_name(series, base),
             *break_even_text(series.break_even(world, device, base))]
            for world in series.worlds for device in series.devices for base in series.bases]
    lines += table(["world", "device", "against", "rays per step", "interval", "robots"], rows)
    return lines + auto_lines(series)


def auto_lines(series: Series) -> list[str]:
    """The break-even that the program itself found, and the cost of finding it."""
    if "auto" not in series.backends:
        return []
    rows = []
    for world in series.worlds:
        near = nearness(series, world)
        for n in series.populations(world, "auto"):
            share = series.figure(world, n, "auto", lambda r: r.steps_on_device / r.steps)
            rays = series.column(world, n, "auto", "rays_per_step")
            known = near is not None and n in near.points
            rows.append([world, str(n), number(rays.median) if rays else "", share_text(share),
                         backend_name(series, near.fastest[n]) if known else "",
                         nearness_text(near.points[n]) if known else ""])
        if near is not None:
            rows.append([world, "all", "", "", "", nearness_text(near.mean)])
    return ["With `--opencl` alone, the program finds the break-even during the run. The table "
            "shows the share of steps on the device, and the r_ACC relative to the fastest other "
            f"backend within a repeat, with an interval ({LEVEL:.0%}) estimated from the scatter "
            "of the repeats; \"all\" is the geometric mean. If two other backends are equally "
            "fast, random differences select the faster one, which makes the ratio slightly too "
            "small.", "",
            *table(["world", "robots", "rays per step", "steps on the device", "fastest other",
                    "r_ACC relative to it"], rows)]


def share_text(share: Summary | None) -> str:
    """Percentage with minimum and maximum."""
    return f"{share.median:.0%} ({share.least:.0%} to {share.greatest:.0%})" if share else ""


def nearness_text(near: Nearness) -> str:
    interval = "" if math.isnan(near.low) else f" ({near.low:.2f} to {near.high:.2f})"
    return f"{near.ratio:.2f}{interval}"


# Phases, memory, compiling.

def phases_section(plots: dict[str, Path]) -> list[str]:
    return ["## Phases of a step", "",
            "Gather: sensors add their rays to the batch. Prefilter: the device walks the rays "
            "(nothing on the host). Trace: the host walks the rays, or checks the potential hits "
            "that the device found. Move: bodies move and collide. Callbacks: controllers run. "
            "Other: the rest of the step.", "",
            *picture(plots, "phases", "Phases of a step")]


def memory_section(series: Series, plots: dict[str, Path]) -> list[str]:
    rows = []
    for world in series.worlds:
        for b in series.backends:
            populations = series.populations(world, b)
            if not populations:
                continue
            ends = [series.column(world, n, b, "peak_memory_mb")
                    for n in (populations[0], populations[-1])]
            each = series.memory_per_robot(world, b)
            rows.append([world, backend_name(series, b),
                         *(f"{number(end.median)} at {n}" if end else ""
                           for end, n in zip(ends, (populations[0], populations[-1]))),
                         memory_text(each)])
    return ["## Memory", "",
            "Peak memory of the process on the host; a robot's share is calculated from the "
            "smallest and the greatest population. The memory of a GPU is not included.", "",
            *picture(plots, "memory", "Memory against the population"),
            *table(["world", "backend", "MiB, smallest", "MiB, greatest", "KiB per robot"],
                   rows)]


def memory_text(kib_per_robot: float | None) -> str:
    """If loading needs more memory than the robots, their share cannot be measured."""
    if kib_per_robot is None:
        return ""
    return number(kib_per_robot) if kib_per_robot > 0 else "hidden by the peak of loading"


def compile_section(series: Series) -> list[str]:
    if not series.devices:
        return []
    rows = []
    for device in series.devices:
        cold, warm = series.compiling(device)
        rows.append([backend_name(series, device), number(cold.compile_seconds) if cold else "",
                     number(cold.process_seconds) if cold else "", spread(warm)])
    return ["## Compiling the kernels", "",
            "Seconds for compiling the kernels in the first run, with an empty kernel cache, and "
            "in later runs. Some drivers compile more at the first launch, which only the time of "
            "the whole run includes. r_ACC doesn't include compiling.", "",
            *table(["device", "first run: compile s", "first run: whole s", "later: compile s"],
                   rows)]


def same_results_lines(series: Series) -> list[str]:
    """States how many hashes were compared."""
    points = {(r.commit, r.world, r.population, r.seed, r.simulated_seconds) for r in series.good}
    wrong = len(differences(series.records))
    what = f"{len(points)} combinations of world, population and simulated seconds"
    text = f"**{wrong} of {what} ended in different states.**" if wrong else \
        f"All runs of each of {what} ended in the same state (equal state hashes)."
    return ["## Same results", "", f"{text} {len(series.good)} runs were compared.", ""]


def heat_section(series: Series) -> list[str]:
    """Temperatures and causes of slow-downs, only with --board."""
    watched = [r for r in series.measured if not math.isnan(r.cooling_seconds) or r.throttled]
    if not watched:
        return []

    def span(column: str, scale: float = 1.0) -> str:
        return spread(summary(getattr(r, column) * scale for r in watched
                              if not math.isnan(getattr(r, column)))) or "not known"
    lines = ["## Heat and clock", "",
             "Median (minimum to maximum) over the measured runs. The chip cooled down before each "
             "run. Temperatures are those of the hottest sensor. The clock is the lowest value of "
             "the fastest core during a run; it is also low if a governor saves power.", "",
             *table(("", ""), [("degrees Celsius before a run", span("celsius_before")),
                               ("maximum during the run", span("celsius_most")),
                               ("seconds of cooling", span("cooling_seconds")),
                               ("clock, percent of its maximum", span("clock_least", 100))])]
    slowed = [r for r in watched if r.throttled]
    if all(math.isnan(r.celsius_most) and math.isnan(r.clock_least) for r in watched) and not slowed:
        return lines + ["This machine shows neither temperature nor clock: whether it was throttled "
                        "is not known.", ""]
    if not slowed:
        return lines + ["No sensor reported that the chip was throttled.", ""]
    return lines + table(("world", "robots", "backend", "repeat", "degrees at most", "why"),
                         [(r.world, r.population, backend_name(series, r.backend), r.repeat,
                           "" if math.isnan(r.celsius_most) else number(r.celsius_most),
                           r.throttled) for r in slowed])


def report_text(series: Series, facts: list[dict], plots: dict[str, Path],
                missing_plots: str) -> str:
    """The whole report."""
    devices = sorted({short_device(r.device) for r in series.measured if r.device})
    title = "; ".join(values(series, "machine")).split(" + ", maxsplit=1)[0]
    lines = [f"# Benchmark series: {title}{', ' if devices else ''}{', '.join(devices)}", "",
             *warnings(series)]
    if missing_plots:
        lines += [f"> {missing_plots}", ""]
    lines += [*measured_section(series, facts), *same_results_lines(series),
              *heat_section(series),
              *speed_section(series, plots), *energy_section(series, plots),
              *relative_section(series, plots), *averages_section(series, plots),
              *break_even_section(series), *phases_section(plots),
              *memory_section(series, plots), *compile_section(series),
              "Written by `benchmarks/series`; `raw.csv` has one line per run."]
    return "\n".join(lines) + "\n"


def read_facts(folder: Path) -> list[dict]:
    """Facts about the machines of the runs in the folder."""
    try:
        return json.loads((folder / MACHINE_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []


def add_facts(folder: Path, fact: dict) -> None:
    """Adds a machine unless it is listed. The memory that PoCL reports varies and is ignored."""
    facts = read_facts(folder)
    if fact["identity"] not in [known.get("identity") for known in facts]:
        text = json.dumps([*facts, fact], indent=2)
        (folder / MACHINE_FILE).write_text(text + "\n", encoding="utf-8")
