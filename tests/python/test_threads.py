# SPDX-License-Identifier: GPL-2.0-or-later
"""Several Python threads use the same worlds: each call works or raises StageError, and none crashes.

The tests call all functions of public classes and of their compiled parts. A new function with arguments needs an
entry in ARGUMENTS; the tests say so.
"""

from __future__ import annotations

import inspect
import os
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from patience import PATIENCE
from stagesim import _core
from stagesim.scenes import Scene

BLOCKER = """
#include <fstream>
#include <string>
#include "stage.hh"
namespace {
// Tells that the step has begun, and waits until it may end.
int Update(Stg::Model* model, void*) {
  if (model->GetWorld()->SimTimeNow() < 300000) return 0;
  const std::string folder = FOLDER;
  { std::ofstream begun(folder + "/begun"); }
  { std::ifstream end(folder + "/end"); }
  return 0;
}
}
extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  model->DeclareNoState("blocker");
  model->AddCallback(Stg::Model::CB_UPDATE, Update, nullptr);
  model->Subscribe();
  return 0;
}
"""

ROBOT = """
define body position( size [0.4 0.4 0.4]
  ranger( sensor( range [0 5] fov 90 samples 4 ) )
  fiducial( range_max 5 range_max_id 5 ) blobfinder( colors_count 1 colors [ "red" ] )
  camera( resolution [4 4] range [0.2 8] ) bumper( bcount 1 bpose[0] [0.2 0 0 0 0.2] ) radio() light() )
metric( kind "distance" )
model( name "wall" size [0.1 4 1] pose [2 0 0 0] color "red" )
"""

#: Arguments of functions.
ARGUMENTS: dict[str, Any] = {
    "World.step": (1,), "World.run": (0.1,), "World.cast": ([[0, 0, 0]], 0, 5), "World.set_metric": ("mine", 1.0),
    "World.model": ("r",), "World.log": ("/dev/null",), "Batch.log": ("/dev/null",),
    "World.include": ("robots/turtlebot3_burger.inc",), "World.restore": "snapshot",
    "World.render": (8, 8), "Batch.restore": "snapshot",
    "Batch.snapshot": (0,), "Batch.fork": (0,), "Batch.state_hash": (0,), "Batch.rollout": {"moments": 2},
    "Batch.teleport": ([0, 0, 0],), "Batch.place": ([0, 0, 0],), "Batch.set_map": (None, Scene()),
    "Batch.load": (np.zeros((3, 8), np.uint64),), "Batch.cast": ([[0, 0, 0]], 0, 5),
    "Batch.vary": ("world.quit_time", [1, 2, 3]),
    "Batch.render": (0, 8, 8), "Fleet.teleport": ([0, 0, 0],), "Fleet.send": (b"hello",), "Fleet.switch_lights": (True,),
    "Fleet.set_light_intensity": (1.0,), "Fleet.set_light_color": ([1, 0, 0, 1],), "Model.drive": (0.1,),
    "Model.go_to": (1, 1), "Model.move_actuator": (0.1,), "Model.add_sensor": (5, 1, 3), "Fleet.sensor": ("ranger",),
    "Batch.sensor": ("ranger",), "Fleet.array": ("ranger.ranges",), "Batch.array": ("pose",),
}
#: Functions that make new worlds.
MAKERS = {"World.from_text", "World.of", "World.from_grid", "World.from_map", "Batch.of"}
#: Properties that are constant and access no world.
CONSTANT = {"Model.id", "_core.Crowd.size", "Batch.threads", "_core.Batch.crowd", "_core.Batch.threads", "Batch.device",
            "Batch.synchronous", "Batch.varied", "_core.Batch.device", "_core.Batch.device_crowd"}
#: Functions of closed worlds, which those of these tests are not; test_states.py calls them on several threads.
OF_CLOSED = ("Batch.state", "Batch.load")
#: Compiled classes, whose functions the public classes call.
COMPILED = (_core.Simulation, _core.Batch, _core.Crowd)
OF_BATCH: tuple[type, ...] = (st.Batch, _core.Batch)
OF_WORLD: tuple[type, ...] = (st.World, st.Model, st.Fleet, _core.Simulation, _core.Crowd)
SANITIZED = "TSAN_OPTIONS" in os.environ or "ASAN_OPTIONS" in os.environ
SECONDS, ROUNDS = (20, 20) if SANITIZED else (2, 60)


def members(cls: type) -> Iterator[tuple[str, Any]]:
    """Yields public properties and functions, including those of base classes."""
    for name in dir(cls):
        if not name.startswith("_"):
            yield name, inspect.getattr_static(cls, name)


def is_property(member: Any) -> bool:
    return isinstance(member, property) or inspect.isdatadescriptor(member)


def call_of(subject: Callable[[], Any], snapshot: st.Snapshot, cls: type, name: str, member: Any) -> Callable[[], Any]:
    """A function that reads the property or calls the function."""
    if is_property(member):
        return lambda: getattr(subject(), name)
    given = ARGUMENTS.get(f"{cls.__name__}.{name}", ())
    if given == "snapshot":
        given = (snapshot,)
    positional, named = ((), given) if isinstance(given, dict) else (given, {})
    try:
        inspect.signature(getattr(cls, name)).bind(None, *positional, **named)
    except ValueError:
        pass  # compiled functions have no signature
    except TypeError:
        raise AssertionError(f"{cls.__name__}.{name} takes arguments: add some to ARGUMENTS") from None
    return lambda: getattr(subject(), name)(*positional, **named)


def forgetful(made: Any) -> Any:
    """Clears the cached arrays and sensors."""
    for kept in ("_views", "_sensors"):
        getattr(made, kept, {}).clear()
    return made


class Subjects:
    """A world, a batch, and their fleets, models and sensors."""

    def __init__(self, text: str) -> None:
        self.world = st.World.from_text(text)
        self.batch = st.Batch.of(self.world, 3, threads=2)
        self.snapshot = self.world.snapshot()
        model, fleet = self.world.model("r"), self.world.fleet()
        self._fleet = fleet
        self._of: dict[type, Callable[[], Any]] = {
            st.World: lambda: self.world, st.Model: lambda: model, st.Fleet: lambda: forgetful(fleet),
            _core.Simulation: lambda: self.world._core, _core.Crowd: lambda: fleet._crowd,
            st.Batch: lambda: forgetful(self.batch), _core.Batch: lambda: self.batch._core,
        }

    def calls(self, classes: tuple[type, ...]) -> dict[str, Callable[[], Any]]:
        """All public functions and properties by name; for compiled classes only the properties."""
        found: dict[str, Callable[[], Any]] = {}
        for cls in classes:
            of = self._of[cls]
            for name, member in members(cls):
                if cls in COMPILED:
                    if is_property(member):
                        found[f"_core.{cls.__name__}.{name}"] = call_of(of, self.snapshot, cls, name, member)
                elif f"{cls.__name__}.{name}" not in MAKERS:
                    found[f"{cls.__name__}.{name}"] = call_of(of, self.snapshot, cls, name, member)
        if st.Fleet in classes:
            for kind in ("ranger", "fiducial", "blobfinder", "bumper", "camera"):
                sensor = self._fleet.sensor(kind)
                for reading in ("time", *(reading.name for reading in sensor.readings)):
                    found[f"{kind}.{reading}"] = partial(sensor._view, reading)
        return found


def test_all_calls_are_refused_while_another_thread_steps(tmp_path: Path,
                                                          plugin_of: Callable[[str, Path], Path]) -> None:
    for name in ("begun", "end"):
        os.mkfifo(tmp_path / name)
    plugin_of(BLOCKER.replace("FOLDER", f'"{tmp_path}"'), tmp_path / "blocker.so")
    subjects = Subjects(ROBOT + f'body( name "r" ctrl "{tmp_path}/blocker.so" )')
    world, batch = subjects.world, subjects.batch
    world.step(2)
    batch.step(2)
    batch_calls = subjects.calls(OF_BATCH)
    world_calls = {**subjects.calls(OF_WORLD), "Batch.of": lambda: st.Batch.of(world, 2)}
    for step, calls in ((lambda: world.step(), world_calls), (lambda: batch.step(ids=0), batch_calls)):
        thread = threading.Thread(target=step)
        thread.start()
        with open(tmp_path / "begun", "rb"):
            pass  # waits until the thread is in the middle of the step
        try:
            assert [name for name, call in calls.items() if name not in CONSTANT and not is_refused(call)] == []
        finally:
            with open(tmp_path / "end", "wb"):
                pass
            thread.join()


def is_refused(call: Callable[[], Any]) -> bool:
    """True if the call is refused because the world is in use."""
    try:
        call()
    except st.StageError as error:
        return "in use by another thread" in str(error)
    return False


def test_no_call_crashes_while_another_thread_resets() -> None:
    """Each call works sometimes and is refused at other times."""
    subjects = Subjects(ROBOT + 'body( name "r" ) body( name "s" pose [0 3 0 0] )')
    calls = {name: call for name, call in subjects.calls((*OF_WORLD, *OF_BATCH)).items()
             if name not in ("World.close", "Model.delete", "World.run", *OF_CLOSED)}
    world, batch = subjects.world, subjects.batch
    changes = (world.reset, world.step, lambda: world.restore(subjects.snapshot), batch.reset, batch.step,
               lambda: batch.restore(subjects.snapshot), lambda: batch.reset(seeds=[7, 8, 9]))
    made = [0] * len(changes)  # how often each was allowed
    wrong: list[Exception] = []  # what ended the thread
    over = threading.Event()

    def disturb() -> None:
        while not over.is_set() and not wrong:
            for i, change in enumerate(changes):
                try:
                    change()
                    made[i] += 1
                except st.StageError:
                    pass
                except Exception as error:
                    wrong.append(error)
            time.sleep(0)

    thread = threading.Thread(target=disturb)
    thread.start()
    try:
        worked: set[str] = set()
        end, latest = time.monotonic() + SECONDS, time.monotonic() + PATIENCE
        while time.monotonic() < (end if len(worked) == len(calls) and min(made) > 0 else latest) and not wrong:
            for name, call in calls.items():
                if was_allowed(call):
                    worked.add(name)
    finally:
        over.set()
        thread.join()
    assert wrong == []
    assert min(made) > 0, made
    assert set(calls) - worked == set()


def test_no_call_crashes_while_another_thread_closes() -> None:
    """In each round it closes later, so that it does so at all calls. Rounds are added until it was in the middle."""
    taken, amid = 0.0, 0  # seconds that all calls take; rounds in which only some calls worked
    done, latest = 0, time.monotonic() + PATIENCE
    while done < ROUNDS or (amid < ROUNDS // 10 and time.monotonic() < latest):
        subjects = Subjects(ROBOT + 'body( name "r" )')
        calls = {name: call for name, call in subjects.calls(OF_WORLD).items()
                 if name not in ("World.close", "Model.delete", "World.run", *CONSTANT)}
        thread = threading.Thread(target=closer(subjects.world, taken * (done % ROUNDS) / ROUNDS))
        began = time.monotonic()
        if done > 0:
            thread.start()
        worked = [was_allowed(call) for call in calls.values()]
        if done == 0:
            taken = time.monotonic() - began
            assert all(worked)
            thread.start()
        thread.join()
        amid += any(worked) and not worked[-1]
        done += 1
        subjects.world.close()
        with pytest.raises(st.GoneError):
            subjects.world.step()
    assert amid >= ROUNDS // 10


def was_allowed(call: Callable[[], Any]) -> bool:
    """Makes the call; returns False if the world is in use by another thread, or gone."""
    try:
        call()
    except st.StageError:
        return False
    except TypeError as error:  # for example, `sensors` of a model that is not a ranger
        return "found a model of the type" in str(error)
    return True


def closer(world: st.World, delay: float) -> Callable[[], None]:
    """A function that waits `delay` seconds and closes the world as soon as no thread uses it."""
    def close() -> None:
        time.sleep(delay)
        for _ in range(1000):
            try:
                return world.close()
            except st.StageError:
                time.sleep(0)
    return close
