# SPDX-License-Identifier: GPL-2.0-or-later
"""Reports: comparisons of artificial runs, and the page of a real sweep."""

from __future__ import annotations

import base64
import itertools
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import stagesim as st
from stagesim.sweep import Experiment, Plan, run
from stagesim.sweep.plan import Axis
from stagesim.sweep.study import Study, pairs, units_of_metrics
from stagesim.sweep.table import Column


def made_up(common_seeds: bool, effect: float, runs: int = 20) -> Study:
    """An artificial sweep of 3 x 2 sets: `m` grows by `effect` per value of a, b has no effect, seeds have much."""
    plan = Plan("", (Axis("a", ("1", "2", "10")), Axis("b", ("x", "y"))), 0, runs, 1, common_seeds, None, {},
                6 * runs, "")
    random = np.random.default_rng(3)
    of_seed = random.normal(0, 1, runs)
    rows = []
    for index, (a, b, number) in enumerate(itertools.product(plan.axes[0].values, plan.axes[1].values, range(runs))):
        luck = of_seed[number] if common_seeds else random.normal(0, 1)
        m = effect * plan.axes[0].values.index(a) + luck + random.normal(0, 0.1)
        rows.append((index, number, int(a), b, "done", m, m if m > 0 else None, 7.0))
    names = ("index", "run", "a", "b", "status", "m", "sometimes", "same")
    kinds = ("key", "key", "key", "text", "text", "figure", "figure", "figure")
    return Study(plan, [Column(name, kind, [row[at] for row in rows])
                        for at, (name, kind) in enumerate(zip(names, kinds))])


def sure(study: Study) -> set[tuple[str, str, int, int]]:
    """The significant comparisons."""
    return {(one.metric.name, one.axis.name, one.first, one.second)
            for one in study.comparisons() if one.probability < 0.05}


def test_only_real_differences_are_found() -> None:
    found = sure(made_up(False, 2.0))
    assert {("m", "a", 0, 1), ("m", "a", 0, 2), ("m", "a", 1, 2)} <= found
    assert not any(axis == "b" for _, axis, _, _ in found)
    assert sure(made_up(False, 0.0)) == set()


def test_paired_runs_reveal_differences_that_seeds_hide() -> None:
    assert not any(name == "m" for name, *_ in sure(made_up(False, 0.1)))
    paired = made_up(True, 0.1)
    assert {(name, axis) for name, axis, *_ in sure(paired) if name == "m"} == {("m", "a")}
    assert all(one.paired for one in paired.comparisons())


def test_metrics_of_a_study() -> None:
    """A metric with missing values also gets the share of runs with a value; constant metrics are separate."""
    study = made_up(False, 1.0)
    assert [metric.name for metric in study.metrics] == ["m", "sometimes_share", "sometimes"]
    assert study.same == {"same": 7.0}
    assert [axis.numeric for axis in study.axes] == [True, False]
    mean = study.mean(study.metrics[0], study.at([(study.axes[0], 2), (study.axes[1], 0)]))
    assert mean.count == 20 and mean.low < mean.mean < mean.high
    assert abs(mean.mean - 2) < 1


def test_too_few_runs_have_no_probability() -> None:
    comparisons = made_up(False, 5.0, runs=4).comparisons()
    assert comparisons and all(np.isnan(one.probability) for one in comparisons)


def test_pairs_of_values() -> None:
    assert pairs(3) == [(0, 1), (0, 2), (1, 2)]
    assert pairs(6) == [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (0, 5)]


def test_units(world: Path) -> None:
    assert units_of_metrics(str(world)) == {"driven": "m", "swept": "m²", "goal": "s"}
    assert units_of_metrics("there is none") == {}


def test_page(experiment: Experiment, tmp_path: Path, own_metrics: None) -> None:
    """The page is self-contained, has all pictures and lists the failed runs."""
    pytest.importorskip("matplotlib", reason="skipped: matplotlib is not installed; try tools/setup --sweep")
    results = run(replace(experiment, set={"bots": [2, 6], "world.resolution": [.02, .05, .1]}, runs=2,
                          metrics="own_metrics:fails_once", options={"tries": 1}), out=tmp_path / "out", jobs=2)
    page = results.report()
    text = page.read_text()
    pictures = sorted(page.parent.glob("*.png"))
    assert {f"{metric}-over-{axes}.png" for metric in ("driven", "swept", "r_ACC")
            for axes in ("bots", "world.resolution", "bots-world.resolution")} <= {file.name for file in pictures}
    embedded = [base64.b64decode(data) for data in re.findall(r"src='data:image/png;base64,([^']*)'", text)]
    assert sorted(embedded) == sorted(picture.read_bytes() for picture in pictures)
    assert not re.search(r"(src|href)=['\"](?!data:|#)", text)
    [failed] = results.failed
    assert failed["replay"].replace("'", "&#x27;") in text and "found that seed" in text
    assert "11 of 12 runs are done" in text and "1 failed" in text


def test_a_report_replaces_only_reports(experiment: Experiment, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="skipped: matplotlib is not installed; try tools/setup --sweep")
    results = run(replace(experiment, runs=1), out=tmp_path / "out", jobs=2)
    out = results.folder / "report"

    def refused(found: str) -> None:
        before = {file: file.read_bytes() for file in results.folder.rglob("*") if file.is_file()}
        done = subprocess.run([st._paths.PROGRAM, "report", str(results.folder)], capture_output=True, text=True,
                              check=False, env={**os.environ, "STAGE_PYTHON": sys.executable})
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
        assert f"{out}: found {found}" in done.stderr
        assert {file: file.read_bytes() for file in results.folder.rglob("*") if file.is_file()} == before

    out.mkdir()  # an empty folder may be used
    page = results.report()
    (out / "driven-over-bots.png").write_bytes(b"older")
    assert results.report() == page and (out / "driven-over-bots.png").read_bytes()[1:4] == b"PNG"
    assert not list(results.folder.glob(".report-*"))
    for own in ("notes.txt", "photo.png", ".hidden", "deep/er.txt"):
        (out / own).parent.mkdir(exist_ok=True)
        (out / own).write_text("precious")
        refused(f"'{own.split('/')[0]}', which no report has made")
        (out / own).unlink()
    (out / "deep").rmdir()
    page.write_text("a page of somebody else")
    refused("'driven-over-bots.png', which no report has made")
    shutil.rmtree(out)
    out.write_text("precious")
    refused("something else than a folder")
    out.unlink()
    (tmp_path / "elsewhere").mkdir()
    out.symlink_to(tmp_path / "elsewhere")
    refused("something else than a folder")


def test_program_makes_the_same_page(experiment: Experiment, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="skipped: matplotlib is not installed; try tools/setup --sweep")
    results = run(replace(experiment, set={"bots": [2, 6]}), out=tmp_path / "out", jobs=2)
    first = results.report().read_bytes()
    done = subprocess.run([st._paths.PROGRAM, "report", str(results.folder)], capture_output=True, text=True,
                          check=True, env={**os.environ, "STAGE_PYTHON": sys.executable})
    page = Path(done.stdout.strip())
    assert page == results.folder / "report/index.html" and page.read_bytes() == first


@pytest.mark.parametrize("options, there", [({"log": True}, True), ({}, False),
                                            ({"log": True, "no-controllers": True}, False)])
def test_places_of_robots(experiment: Experiment, tmp_path: Path, options: dict[str, bool], there: bool) -> None:
    """There is a picture of places if there are logs in which something has moved."""
    pytest.importorskip("matplotlib", reason="skipped: matplotlib is not installed; try tools/setup --sweep")
    results = run(replace(experiment, set={}, runs=2, options=options), out=tmp_path / "out", jobs=2)
    page = results.report()
    assert (page.parent / "where-robots-were.png").exists() == there
    assert ("Where robots spent their time" in page.read_text()) == there


def test_nothing_to_report(experiment: Experiment, tmp_path: Path) -> None:
    from stagesim.sweep.program import make_plan

    make_plan(experiment, tmp_path / "out")
    done = subprocess.run([sys.executable, "-m", "stagesim.sweep", "report", str(tmp_path / "out")],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "found no run that is done" in done.stderr and done.stderr.count("\n") == 1
