# SPDX-License-Identifier: GPL-2.0-or-later
"""Each option of worlds in each place of the package that has options: functions, docstrings, command lines, sweeps.

tests/program/cli_run_options_test.cc has the places in the program.
"""

from __future__ import annotations

import inspect
import pickle
from pathlib import Path
from typing import Any

import pytest
import stagesim as st
from stagesim import _core, _options

DEFAULTS = {option.name: option.default for option in _core.run_options() if option.of_world}
#: Values by the kind of the option: as an argument, in the world, and as words of a command line.
SAMPLES: dict[str, list[tuple[Any, Any, list[str]]]] = {
    "number": [(2, 2, ["=2"])], "device": [(True, "", [""]), ("auto", "auto", ["=auto"])],
    "texts": [({"world.resolution": 0.05}, ["world.resolution=0.05"], ["=world.resolution=0.05"])]}
WRONG: dict[str, list[Any]] = {"switch": [1, "yes", None], "number": [-1, 2**64, 1.0, "2", True],
                               "choice": ["", "x", 1], "device": [1, 2.0], "texts": ["robots=1", [1]]}


def cases() -> list[Any]:
    """An option, a value for it, the value that the world has, and the words of a command line."""
    found = []
    for option in _options.OPTIONS.values():
        samples = SAMPLES.get(option.kind) or [(choice, choice, [f"={choice}"]) for choice in option.choices] or [
            (not option.default, not option.default, [""])]
        found += [pytest.param(option, value, kept, [f"--{option.flag}{word}" for word in words],
                               id=f"{option.name}-{value}") for value, kept, words in samples]
    return found


def expected(name: str, kept: Any) -> dict[str, Any]:
    """The options of a world in which one is set."""
    implied = {"opencl": ""} if name == "opencl_always" else {}
    return {**DEFAULTS, **implied, name: kept}


@pytest.mark.parametrize(("option", "value", "kept", "words"), cases())
def test_each_option_in_each_place(option: Any, value: Any, kept: Any, words: list[str], tmp_path: Path) -> None:
    file = tmp_path / "w.world"
    file.write_text('resolution 0.1 model( name "m" ) position( name "r" )')
    name, wanted = option.name, expected(option.name, kept)
    world = st.World(file, **{name: value})
    assert world._core.options() == wanted
    assert st.World.from_text(file.read_text(), **{name: value})._core.options() == wanted
    assert pickle.loads(pickle.dumps(world))._core.options() == wanted
    assert world.fork()._core.options() | {"opencl": wanted["opencl"]} == wanted  # copies share the device

    from stagesim.live import __main__ as live

    given = _options.given_in(live.parsed([*words, str(file)]))
    assert list(given) == [name] and _options.complete(given) == {**DEFAULTS, name: kept}
    if name in ("seed", "threads"):
        return
    batch = st.Batch(file, 1, seeds=[1], **{name: value})
    if name != "opencl":  # copies share the device of the first world
        assert batch.fork(0)._core.options()[name] == kept


@pytest.mark.parametrize(("option", "value", "kept", "words"), cases())
def test_each_option_of_the_ros_node(option: Any, value: Any, kept: Any, words: list[str]) -> None:
    pytest.importorskip("rclpy")
    from stagesim.ros.main import options

    parsed = options(["ros", *words, "w.world"])
    given = _options.given_in(parsed)
    assert parsed.world == "w.world" and list(given) == [option.name]
    assert _options.complete(given) == {**DEFAULTS, option.name: kept}


@pytest.mark.parametrize(("option", "value", "kept", "words"), cases())
def test_each_option_in_experiments(option: Any, value: Any, kept: Any, words: list[str], tmp_path: Path) -> None:
    from stagesim.sweep import Experiment, program

    (tmp_path / "w.world").write_text('quit_time 1 resolution 0.1 model( name "m" )')
    text = kept if option.kind == "choice" or (option.kind == "device" and kept) else True
    if option.kind in ("number", "texts"):
        text = kept if option.kind == "number" else kept[0]
    program.make_plan(Experiment(tmp_path / "w.world", options={option.flag: text}), tmp_path / "out")
    options = _core.Sweep(str(tmp_path / "out")).options(0)
    if option.name != "seed":  # runs have seeds that are derived from that of the sweep
        assert options[option.name] == kept
    others = {name: value for name, value in options.items() if name not in (option.name, "seed", "threads", "opencl")}
    assert others == {name: DEFAULTS[name] for name in others}


@pytest.mark.parametrize("option", _options.OPTIONS.values(), ids=lambda option: option.name)
def test_wrong_values_are_refused(option: Any, room: str) -> None:
    for value in WRONG[option.kind]:
        with pytest.raises((TypeError, ValueError)) as raised:
            st.World.from_text(room, **{option.name: value})
        text = str(raised.value)
        assert text.startswith("found ") and ", expected " in text and "\n" not in text, text
    for call in (st.World.from_text, lambda room, **options: st.Batch("arena.world", 1, **options)):
        with pytest.raises(TypeError, match="found the argument 'thread', expected"):
            call(room, thread=1)
    with pytest.raises(TypeError, match="found the argument 'seed', expected"):
        st.Batch("arena.world", 1, seed=1)


def test_signatures_and_docstrings_have_all_options() -> None:
    for function, without in ((st.World.__init__, ()), (st.World.from_text, ()),
                              (st.Batch.__init__, ("seed", "threads"))):
        names = set(inspect.signature(function).parameters)
        assert names >= set(DEFAULTS) - set(without) and "options" not in names
    documented = inspect.getdoc(st.World) or ""
    for option in _options.OPTIONS.values():
        assert f"\n    {option.name}: " in documented
        assert " ".join(option.summary.split()) in " ".join(documented.split())
    assert "OPTIONS" not in documented and all(len(line) <= 110 for line in documented.splitlines())
