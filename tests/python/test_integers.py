# SPDX-License-Identifier: GPL-2.0-or-later
"""Integer arguments and properties refuse bools, floats, and everything that would be truncated to an integer.

The arguments are read from the signatures of the functions, so a new function needs an entry in CALLS.
"""

from __future__ import annotations

import inspect
import re
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim import _core, _paths
from stagesim.scenes import Scene

NO_INTEGERS = (True, False, np.True_, 1.0, np.float32(1), np.float64(1), Decimal(1), Fraction(1), "1", b"1", 1j, [1],
               np.array([1]))
LARGE = 2**64


@cache
def batch_on_device() -> st.Batch | None:
    """A batch on an OpenCL device, which is opened once; None: there is no such device."""
    world = st.World.from_text('contacts "cells" position( ranger( sensor( samples 2 ) ) )')
    try:
        return st.Batch.of(world, 1, threads=1, device="opencl")
    except st.StageError as error:
        if "OpenCL" not in str(error):
            raise
        return None


@cache
def sweep_folder() -> tempfile.TemporaryDirectory[str]:
    """A folder with a planned sweep of a world in its folder "out"."""
    folder = tempfile.TemporaryDirectory()
    Path(folder.name, "w.world").write_text("quit_time 1")
    subprocess.run([_paths.PROGRAM, "sweep", f"{folder.name}/w.world", "--plan-only", "-o", f"{folder.name}/out"], check=True)
    return folder


class Subjects:
    """A world and a batch whose robots have all sensors."""

    def __init__(self) -> None:
        self.world = st.World.from_text("""
            define body position( ranger( sensor( samples 2 ) ) fiducial() blobfinder() bumper( bcount 1 ) radio()
              camera( resolution [4 4] ) )
            body() body( pose [3 0 0 0] )""")
        self.batch = st.Batch.of(self.world, 2, threads=1)
        self.on_device = batch_on_device()
        self.core = self.world._core
        self.model = self.world.models[0]
        self.ids = [self.model.id]
        self.pixels = np.zeros((4, 4, 3), np.uint8)
        self.which = np.array([0], np.uint32)
        self.recorded = np.zeros((1, 2), bool)
        self.poses, self.none = np.zeros((2, 1, 3)), np.zeros((2, 1), bool)
        self.lit = st.World.from_text("position( light() )")
        self.folder = sweep_folder()
        self.sweep = _core.Sweep(f"{self.folder.name}/out")
        self.robot_file = f"{self.folder.name}/robot.world"
        Path(self.robot_file).write_text('position( name "r" )')
        self.belief = st.Belief(self.robot_file, "r")
        self.engine = st.ConsequenceEngine(self.belief, samples=1, threads=1)
        self.plans, self.numbers = np.zeros((1, 1, 3)), np.array([1, 0, 0.2, 1, 0.1, 0.2, 0.1, 0, 0, 0])

    def map_file(self) -> Path:
        """The path of a map of map_server."""
        folder = Path(self.folder.name)
        (folder / "map.pgm").write_text("P2 1 1 255 0")
        (folder / "map.yaml").write_text("image: map.pgm\nresolution: 1\norigin: [0, 0, 0]")
        return folder / "map.yaml"


def crowd_calls(crowd: Any, prefix: str) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """The functions of a fleet or a batch that return sensors."""
    return {
        f"{prefix}.sensor": (crowd.sensor, {"type": "fiducial", "index": 0, "most": 2}),
        f"{prefix}.ranger": (crowd.ranger, {"index": 0}), f"{prefix}.camera": (crowd.camera, {"index": 0}),
        f"{prefix}.bumper": (crowd.bumper, {"index": 0}), f"{prefix}.blobs": (crowd.blobs, {"index": 0, "most": 2}),
        f"{prefix}.fiducials": (crowd.fiducials, {"index": 0, "most": 2})}


def skip(**_: Any) -> None:
    """Stands for a function of a batch on a device where there is none."""
    pytest.skip("there is no OpenCL device")


def compiled_calls(s: Subjects) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Each compiled function with valid arguments."""
    batch, core, model = s.batch._core, s.core, s.model
    add_sensor, crowd = s.world.create("ranger").add_sensor, s.world.fleet()._crowd
    lamp = {"crowd": s.lit.fleet()._crowd, "index": 0}
    log = {"file": "/dev/null", "every": 0, "models": [], "compression": "", "by_rep_117": True}
    return {
        "Crowd.sensor": (s.world.fleet()._crowd.sensor, {"type": "fiducial", "index": 0, "most": 2, "reading": "id"}),
        "DeviceCrowd.sensor": (s.on_device._core.device_crowd.sensor if s.on_device else skip,
                               {"type": "ranger", "index": 0, "most": 0, "reading": "ranges"}),
        "NamingScheme.numbered": (_core.naming_schemes()[0].numbered, {"base": "name", "number": 1, "count": 2}),
        "find_bits": (_core.find_bits, {"keys": np.ones(2, np.uint64), "first": 1,
                                         "to": np.zeros((2, 3), np.uint64)}),
        "make_belief": (_core.make_belief, {"file": s.robot_file, "text": None, "pictures": {}, "robot": "r", "lengths": np.full(2, 0.5),
                                            "origin": np.zeros(3), "sizes": np.ones((1, 3)), "bodies": [""], "rows": 1, "columns": 1,
                                            "others_clear_cells": False}),
        "make_engine": (_core.make_engine, {"belief": s.belief._core, "samples": 1, "most_samples": 1, "preference": 1,
                                            "numbers": np.ones(4), "threads": 1, "device": "", "on_device": False}),
        "ConsequenceEngine.choose": (s.engine._core.choose, {"plans": s.plans, "numbers": s.numbers, "judge": None,
                                                              "steps": 1, "seed": 1}),
        "ConsequenceEngine.replay": (s.engine._core.replay, {
            "plans": s.plans, "numbers": s.numbers, "judge": None, "steps": 1, "seed": 1,
            "decision": s.engine.choose([[0, 0, 0]], (1, 0), radius=0.2)._core}),
        "Decision.future": (s.engine.choose([[0, 0, 0]] * 2, (1, 0), radius=0.2)._core.future, {"plan": 1}),
        "sensor_name": (_core.sensor_name, {"ranger": "name", "number": 1}),
        "Sweep.options": (s.sweep.options, {"index": 0}),
        "Sweep.start_log": (s.sweep.start_log, {"index": 0, "world": core}),
        "Sweep.write_record": (s.sweep.write_record, {"index": 0, "world": core, "attempt": 1, "wall_seconds": 1.0,
                                                      "metrics": []}),
        "Model.fiducial_return": (lambda arg: setattr(model, "fiducial_return", arg), {"arg": 1}),
        "Model.fiducial_key": (lambda arg: setattr(model, "fiducial_key", arg), {"arg": 1}),
        "Model.add_sensor": (add_sensor, {"range": 5, "fov": 1, "samples": 3}),
        "Batch.__init__": (_core.Batch, {"prototypes": [core], "seeds": [1], "variants": [0], "threads": 1,
                                         "robots": [s.ids]}),
        "Batch.set_failures": (batch.set_failures, {"failures": {1: "why"}}),
        "Batch.another": (batch.another, {"seeds": [1]}),
        "Batch.render": (batch.render, {"index": 0, "x": 0, "y": 0, "scale": 1, "data": True, "to": s.pixels}),
        "Batch.fit": (batch.fit, {"index": 0, "width": 4, "height": 4}),
        "Batch.step": (batch.step, {"which": s.which, "steps": 1}),
        "Batch.rollout": (batch.rollout, {"moments": 1, "steps": 1, "commands": None, "live": [], "to": [],
                                          "recorded": s.recorded}),
        "Batch.reseed": (batch.reseed, {"seeds": [1] * s.batch.n}),
        "Batch.place": (batch.place, {"models": [s.ids], "poses": s.poses, "which": s.none}),
        "Batch.find_places": (batch.find_places, {"models": [s.ids], "to": s.poses}),
        "Batch.values_of": (batch.values_of, {"index": 1}),
        "Batch.set_prototype": (batch.set_prototype, {"variant": 1, "prototype": core, "robots": 2 * s.ids,
                                                        "varied": [[s.ids[0], 0, 0]], "properties": ["mass"]}),
        "Batch.take": (batch.take, {"index": 0}),
        "Batch.fork": (batch.fork, {"index": 0}),
        "Batch.start_log": (batch.start_log, {"index": 0, **log}),
        "Simulation.start_log": (core.start_log, log),
        "Simulation.section_texts": (core.section_texts, {"section": 1, "property": "size"}),
        "Simulation.is_called": (core.is_called, {"section": 1, "selector": "position"}),
        "Simulation.can_vary": (core.can_vary, {"model": 1, "sensor": 0, "property": "mass"}),
        "Simulation.step": (core.step, {"steps": 1}),
        "Simulation.reset": (core.reset, {"seed": 1}),
        "Simulation.fit": (core.fit, {"width": 4, "height": 4}),
        "Simulation.find_id": (core.find_id, {"id": 1}),
        "Simulation.body": (core.body, {"id": 1}),
        "Simulation.scans": (core.scans, {"ids": s.which, "most": 4}),
        "Simulation.crowd": (core.crowd, {"ids": s.ids}),
        "Simulation.send": (core.send, {"crowd": crowd, "index": 0, "payloads": np.zeros((crowd.size, 1), np.uint8),
                                        "which": np.ones(crowd.size, bool)}),
        "Simulation.messages": (core.messages, {"crowd": crowd, "index": 0}),
        "Simulation.draw_scenery": (core.draw_scenery, {"height": None, "rows": 2, "columns": 2, "resolution": 1.0,
                                                        "origin": (0.0, 0.0, 0.0)}),
        "Simulation.switch_lights": (s.lit._core.switch_lights, {**lamp, "on": np.ones(1, bool), "which": np.ones(1, bool)}),
        "Simulation.set_lights": (s.lit._core.set_lights, {**lamp, "numbers": np.ones((1, 1)), "which": np.ones(1, bool)}),
        "Simulation.read_light_numbers": (s.lit._core.read_light_numbers, {**lamp, "numbers": np.ones((1, 1))}),
        "Simulation.read_lights": (s.lit._core.read_lights, {**lamp, "on": np.ones(1, bool)}),
    }


def public_calls(s: Subjects) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Each function of World, Batch and Fleet with valid arguments."""
    return {
        **crowd_calls(s.world.fleet(), "Fleet"),
        **crowd_calls(s.batch, "Batch"),
        "Fleet.send": (s.world.fleet().send, {"payload": b"x", "index": 0}),
        "Fleet.messages": (s.world.fleet().messages, {"index": 0}),
        "Fleet.switch_lights": (s.lit.fleet().switch_lights, {"on": True, "index": 0}),
        "Fleet.lights": (s.lit.fleet().lights, {"index": 0}),
        "Fleet.set_light_intensity": (s.lit.fleet().set_light_intensity, {"intensity": 1.0, "index": 0}),
        "Fleet.light_intensity": (s.lit.fleet().light_intensity, {"index": 0}),
        "Fleet.set_light_color": (s.lit.fleet().set_light_color, {"color": (1, 0, 0, 1), "index": 0}),
        "Fleet.light_color": (s.lit.fleet().light_color, {"index": 0}),
        "World.__init__": (st.World, {"file": "arena.world", "seed": 1, "threads": 1}),
        "World.from_text": (st.World.from_text, {"text": "", "seed": 1, "threads": 1}),
        "World.of": (st.World.of, {"scene": Scene(), "seed": 1, "threads": 1}),
        "World.from_grid": (st.World.from_grid, {"array": [[True]], "resolution": 1, "seed": 1, "threads": 1}),
        "World.from_map": (st.World.from_map, {"file": s.map_file(), "seed": 1, "threads": 1}),
        "World.step": (s.world.step, {"n": 1}),
        "World.reset": (s.world.reset, {"seed": 1}),
        "World.render": (s.world.render, {"width": 4, "height": 4}),
        "Batch.__init__": (st.Batch, {"file": "arena.world", "n": 1, "seeds": [1], "threads": 1}),
        "Batch.of": (st.Batch.of, {"world": s.world, "n": 1, "seeds": [1], "threads": 1}),
        "Batch.step": (s.batch.step, {"n": 1}),
        "Batch.reset": (s.batch.reset, {"seeds": [1, 2]}),
        "Batch.rollout": (s.batch.rollout, {"moments": 1, "n": 1}),
        "Batch.contacts": (s.batch.contacts, {"most": 2}),
        "Batch.snapshot": (s.batch.snapshot, {"index": 0}),
        "Batch.fork": (s.batch.fork, {"index": 0}),
        "Batch.state_hash": (s.batch.state_hash, {"index": 0}),
        "Batch.render": (s.batch.render, {"index": 0, "width": 4, "height": 4}),
    }


CALLS = {"compiled": compiled_calls, "public": public_calls}


def parts_of(signature: str) -> Iterator[tuple[str, str]]:
    """Names and types of the arguments in "def f(a: int, b: dict[int, str] = 1) -> int"."""
    depth, part, parts = 0, "", []
    for letter in signature[signature.index("(") + 1:]:
        depth += (letter in "[(") - (letter in ")]")
        if depth < 0 or (letter == "," and depth == 0):
            parts.append(part)
            part = ""
        else:
            part += letter
        if depth < 0:
            break
    for text in parts:
        name, colon, kind = text.partition(":")
        if colon:
            yield name.strip(), kind.partition("=")[0].strip()


def compiled_integers() -> set[tuple[str, str]]:
    """Function and argument, of all compiled functions and setters."""
    found = set()
    classes = [cls for cls in vars(_core).values() if isinstance(cls, type)]
    for owner in (_core, *classes):
        for name, member in vars(owner).items():
            if name == "__new__":  # __init__() has the same arguments
                continue
            function = member.fset if isinstance(member, property) else member
            for signature in getattr(function, "__nb_signature__", None) or ():
                for argument, kind in parts_of(signature[0]):
                    if re.search(r"\bint\b", kind):
                        found.add((name if owner is _core else f"{owner.__name__}.{name}", argument))
    return found


def public_integers() -> set[tuple[str, str]]:
    """Function and argument, of all public functions of these classes."""
    return {(f"{cls.__name__}.{name}", argument.name)
            for cls in (st.World, st.Batch, st.Fleet)
            for name, function in inspect.getmembers(cls, callable)
            if (not name.startswith("_") or name == "__init__") and (cls, name) != (st.Fleet, "__init__")
            for argument in inspect.signature(function).parameters.values()
            if re.search(r"\bint\b", str(argument.annotation))}


INTEGERS = sorted([("compiled", *found) for found in compiled_integers()]
                  + [("public", *found) for found in public_integers()])


def replaced(right: Any, value: Any) -> Any:
    """The value with its first integer, perhaps in a list or in a list of lists, replaced by another value."""
    return [replaced(right[0], value), *right[1:]] if isinstance(right, list) else value


def of_numpy(right: Any) -> Any:
    """The value with NumPy's integers instead of Python's."""
    if isinstance(right, dict):
        return {np.int64(key): value for key, value in right.items()}
    return [of_numpy(part) for part in right] if isinstance(right, list) else np.int64(right)


def wrong_values(right: Any) -> list[Any]:
    """The value with its integer replaced by each invalid one."""
    if isinstance(right, dict):
        return [{value: "why"} for value in NO_INTEGERS if not isinstance(value, (list, np.ndarray))]
    return [replaced(right, value) for value in NO_INTEGERS]


def test_lists_of_arguments_are_complete() -> None:
    """Fails if signatures are parsed wrongly: the list has examples of each kind."""
    some = {("compiled", "Model.fiducial_key", "arg"), ("compiled", "Batch.__init__", "seeds"),
            ("compiled", "Batch.set_failures", "failures"), ("compiled", "sensor_name", "number"),
            ("public", "World.__init__", "threads"), ("public", "Batch.rollout", "moments"),
            ("public", "Fleet.blobs", "most")}
    assert some <= set(INTEGERS)
    for kind, calls in CALLS.items():
        known = {function for of, function, _ in INTEGERS if of == kind}
        assert set(calls(Subjects())) == known, f"add or remove calls of {kind} functions"


@pytest.mark.parametrize("kind, function, argument", INTEGERS)
def test_no_bool_and_no_float(kind: str, function: str, argument: str) -> None:
    subjects = Subjects()  # kept alive, because a crowd does not hold its world
    call, given = CALLS[kind](subjects)[function]
    call(**given)
    right = given[argument]
    accepted = []
    for value in wrong_values(right):
        try:
            call(**{**given, argument: value})
        except TypeError:
            continue
        accepted.append(value)
    assert accepted == []


@pytest.mark.parametrize("kind, function, argument", INTEGERS)
def test_integers_of_numpy_and_of_too_many_bits(kind: str, function: str, argument: str) -> None:
    subjects = Subjects()  # kept alive, because a crowd does not hold its world
    call, given = CALLS[kind](subjects)[function]
    right = given[argument]
    call(**{**given, argument: of_numpy(right)})
    for value in (LARGE, -LARGE):
        too_large = {value: "why"} if isinstance(right, dict) else replaced(right, value)
        with pytest.raises((TypeError, ValueError, OverflowError, IndexError)):
            call(**{**given, argument: too_large})
