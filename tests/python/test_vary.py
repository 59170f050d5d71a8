# SPDX-License-Identifier: GPL-2.0-or-later
"""Values that differ between worlds of a batch: each world equals one that is made from its values alone."""

from __future__ import annotations

import copy
import dataclasses
import os
import pickle
import resource
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim import _variation
from stagesim.scenes import Box, GridMap, Model, Ranger, Robot, Scene

N = 5
BOUNDS = [-.5, .5, -.1, .1, 0, 0, -1, 1]


def walls(seed: int = 0) -> GridMap:
    array = np.random.default_rng(seed).random((24, 30)) < 0.06
    array[[0, -1]] = array[:, [0, -1]] = True
    array[2:14, 2:12] = False
    return GridMap(array, 0.1)


def made(robot: Callable[[int], dict[str, Any]] | None = None, ranger: Callable[[int], dict[str, Any]] | None = None,
         crate: dict[str, Any] | None = None, seed: int = 0, robots: int = 3, **properties: Any) -> Scene:
    """A scene of robots, whose properties differ by their number, and of a crate that they push."""
    own = {"noise": (1e-4, 0, 0), "range": (0, 4), "fov": 5.0, "samples": 9}
    bots = [Robot(**{"pose": (.4 + .31 * i, .6, .2 * i), "size": (.2, .2, .2), **(robot(i) if robot else {}),
                     "sensors": [Ranger(**{**own, **(ranger(i) if ranger else {})})]}) for i in range(robots)]
    box = Box(**{"name": "crate", "pose": (.7, .9, .3), "size": (.3, .3, .4), "pushable": True, "mass": 2.0, **(crate or {})})
    return Scene(walls(seed), [*bots, box], **properties)


def drive(of: Any) -> None:
    _ = of.ranger(0).ranges
    of.cmd[...] = [.35, 0, .5]


def alone(of: Scene, seed: int, steps: int, driven: bool = True) -> str:
    world = st.World.of(of, seed=seed)
    if driven:
        drive(world.fleet())
    world.step(steps)
    return world.state_hash()


def check(batch: st.Batch, scenes: list[Scene], steps: int = 25) -> None:
    drive(batch)
    batch.step(steps)
    assert batch.failed == [None] * batch.n
    hashes = batch.state_hashes()
    for i, of in enumerate(scenes):
        assert hashes[i] == alone(of, batch.seeds[i], steps), i


class Case:
    """A property: values for worlds and matches, and the scene of a world with its values."""

    def __init__(self, name: str, values: Any, scene: Callable[[Any], dict[str, Any]]) -> None:
        self.name, self.values, self.scene = name, values, scene


def cases() -> list[Case]:
    random = np.random.default_rng(7)

    def of_robots(property: str, *shape: Any, pattern: str = "r*") -> Case:
        values = random.uniform(*shape[:2], (N, 3, *shape[2:]))
        return Case(f"{pattern}.{property}", values, lambda v: {"robot": lambda i: {property: v[i].tolist()}})

    bounds = np.array(BOUNDS) * random.uniform(.5, 1.5, (N, 3, 1))
    return [
        of_robots("mass", 1, 50), of_robots("friction", 0, 1), of_robots("wheel_slip", 0, 1), of_robots("odom_noise", 0, .1, 4),
        of_robots("odom_error", 0, .1, 4, pattern="position"), of_robots("size", .1, .25, 3),
        Case("r*.velocity_bounds", bounds, lambda v: {"robot": lambda i: {"velocity_bounds": v[i].tolist()}}),
        Case("position.acceleration_bounds", bounds, lambda v: {"robot": lambda i: {"acceleration_bounds": v[i].tolist()}}),
        Case("ranger.noise", random.uniform(0, .01, (N, 3, 3)), lambda v: {"ranger": lambda i: {"noise": v[i].tolist()}}),
        Case("ranger.noise[1]", random.uniform(0, .2, N), lambda v: {"ranger": lambda i: {"noise": (1e-4, float(v), 0)}}),
        Case("r*.ranger.range[1]", random.uniform(1, 4, (N, 3)), lambda v: {"ranger": lambda i: {"range": (0, float(v[i]))}}),
        Case("r1.ranger:0.fov", random.uniform(1, 6, N), lambda v: {"ranger": lambda i: {"fov": float(v)} if i == 1 else {}}),
        Case("ranger.samples", random.integers(1, 9, (N, 3)), lambda v: {"ranger": lambda i: {"samples": int(v[i])}}),
        Case("r*.*.pose", random.uniform(-.05, .05, (N, 1, 3)), lambda v: {"ranger": lambda i: {"pose": v[0].tolist()}}),
        Case("ranger.update_interval", 100 * random.integers(1, 4, N),
             lambda v: {"ranger": lambda i: {"update_interval": int(v)}}),
        Case("crate.mass", random.uniform(.1, 5, N), lambda v: {"crate": {"mass": float(v)}}),
        Case("crate.floor_friction", random.uniform(0, 1, (N, 1)), lambda v: {"crate": {"floor_friction": float(v[0])}}),
        Case("r*.drive", np.array(["diff", "omni", "car", "omni", "diff"]), lambda v: {"robot": lambda i: {"drive": str(v)}}),
        Case("crate.pushable", np.arange(N) % 2 == 0, lambda v: {"crate": {"pushable": bool(v)}}),
        Case("world.resolution", random.uniform(.02, .05, N), lambda v: {"resolution": float(v)}),
    ]


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("ray_model", ["cell", "exact"])
@pytest.mark.parametrize("contacts", ["outlines", "cells"])
@pytest.mark.parametrize("case", cases(), ids=lambda case: case.name)
def test_each_world_equals_that_of_its_values(case: Case, threads: int, ray_model: str, contacts: str) -> None:
    kinds = {"ray_model": ray_model, "contacts": contacts}
    batch = st.Batch.of(made(**kinds), N, threads=threads)
    batch.vary(case.name, case.values)
    assert list(batch.varied) == [case.name] and np.array_equal(batch.varied[case.name], case.values)
    check(batch, [made(**kinds)] * N)
    batch.reset(np.arange(N) + 10)
    scenes = [made(**kinds, **case.scene(case.values[i])) for i in range(N)]
    check(batch, scenes)
    assert set(batch.explain()) == {None}
    batch.reset(7)
    check(batch, scenes)
    batch.vary(case.name, None)
    batch.reset(8)
    check(batch, [made(**kinds)] * N)
    assert batch.varied == {} and set(batch.variant) == {0}


def both(mass: float, noise: float, seed: int = 0) -> Scene:
    return made(lambda _: {"mass": mass}, lambda _: {"noise": (1e-4, noise, 0)}, seed=seed)


def test_properties_add_up_and_wait_for_the_reset_of_their_world() -> None:
    batch = st.Batch.of(made(), 3)
    batch.vary("r*.mass", [1., 2, 3])
    batch.reset(ids=[0, 1])
    batch.vary("ranger.noise[1]", [.1, .2, .3])
    batch.reset(ids=[1])
    check(batch, [both(1, 0), both(2, .2), made()])
    batch.reset()
    check(batch, [both(1, .1), both(2, .2), both(3, .3)])
    batch.vary("r*.mass", [4., 4, 4])
    batch.vary("ranger.noise[1]", [.1, .1, .1])
    batch.reset()
    assert len(set(batch.variant)) == 1, "equal values share a scene"
    check(batch, [both(4, .1)] * 3)


def test_maps_and_variants_keep_the_values() -> None:
    batch = st.Batch.of([made(), made(seed=1, robots=2)], 4, variant=[0, 1, 0, 1])
    batch.vary("r*.mass", np.arange(1., 5))
    batch.reset()

    def with_mass(mass: float, seed: int, robots: int = 3) -> Scene:
        return made(lambda _: {"mass": mass}, seed=seed, robots=robots)

    check(batch, [with_mass(1, 0), with_mass(2, 1, 2), with_mass(3, 0), with_mass(4, 1, 2)])
    batch.set_map([0, 1], [made(seed=2), walls(3)])
    batch.reset(variant=None)
    check(batch, [with_mass(1, 2), with_mass(2, 3, 2), with_mass(3, 0), with_mass(4, 1, 2)])
    batch.reset(variant=[1, 0, 1, 0])
    check(batch, [with_mass(1, 1, 2), with_mass(2, 0), with_mass(3, 1, 2), with_mass(4, 0)])
    batch.set_map([0], walls(5))
    batch.vary("r*.mass", None)
    batch.reset()
    check(batch, [made(seed=5, robots=2), made(), made(seed=1, robots=2), made()])


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda batch: pickle.loads(pickle.dumps(batch))])
def test_copies_forks_and_snapshots_keep_the_values(duplicate: Callable[[st.Batch], st.Batch]) -> None:
    batch = st.Batch.of(made(), 3)
    batch.vary("r*.mass", [1., 2, 3])
    batch.reset(ids=[0, 1])
    drive(batch)
    batch.step(9)
    snapshot = batch.snapshot(1)
    forks = [batch.fork(i) for i in range(3)]
    copied = duplicate(batch)
    for each in (*forks, *map(copy.deepcopy, forks), *(pickle.loads(pickle.dumps(fork)) for fork in forks)):
        each.step(9)
    batch.step(9)
    copied.step(9)
    assert copied.state_hashes() == batch.state_hashes() == [fork.state_hash() for fork in forks]
    after = batch.state_hash(1)
    batch.restore(snapshot, 1)
    batch.step(9)
    assert batch.state_hash(1) == after
    for each in (copied, batch):
        assert np.array_equal(each.varied["r*.mass"], [1, 2, 3])
        each.reset(5)
        check(each, [both(mass, 0) for mass in (1, 2, 3)])
    forks[1].reset(6)
    drive(forks[1].fleet())
    forks[1].step(5)
    assert forks[1].state_hash() == alone(both(2, 0), 6, 5)


FILE = """
define scanner ranger( sensor( range [0 3] fov 90 samples 5 noise [{noise!r} 0 0] ) sensor( range [0 4] samples 2 fov 10 ) )
define robot position( size [.3 .3 .3] mass {mass!r} scanner() )
robot( name "a" pose [0 0 0 0] ) robot( name "b" pose [0 1 0 30] )
population( name "others" model "robot" count 2 area [-3 -3 3 3] )
model( name "wall" pose [2 0 0 0] size [.1 4 1] )
"""


def test_values_of_files_vary() -> None:
    base = st.World.from_text(FILE.format(noise=.001, mass=10.))
    batch = st.Batch.of(base, 3, seeds=[4] * 3)
    assert batch.names == ("a", "b", "other0", "other1")
    batch.vary("robot.mass", [1., 2, 3])
    first = np.array([[.01, 0] * 4, [.02, 0] * 4, [.03, 0] * 4])
    batch.vary("scanner.noise[0]", first)
    batch.reset()
    drive(batch)
    batch.step(9)
    for i in range(3):
        world = st.World.from_text(FILE.format(noise=float(first[i, 0]), mass=i + 1.), seed=4)
        drive(world.fleet())
        world.step(9)
        assert batch.state_hash(i) == world.state_hash()
    assert base.seed == 1 and len(set(batch.state_hashes())) == 3


class Columns:
    """Random values of all properties that are columns of rows, for n worlds of two robots and a car, and a crate."""

    def __init__(self, n: int, seed: int) -> None:
        random = np.random.default_rng(seed)

        def some(least: float, most: float, *shape: int) -> Any:
            given = random.random((n, *(1 for _ in shape))) < 0.7
            return np.where(given, random.uniform(least, most, (n, *shape)), 0.0)

        self.robots = {"mass": some(1, 30, 3), "wheel_slip": some(0, 1, 3), "friction": some(0, 1, 3),
                       "floor_friction": some(0, 1, 3), "odom_noise": some(0, .05, 3, 4), "odom_error": some(-.1, .1, 3, 4),
                       "velocity_bounds": np.array(BOUNDS) * random.uniform(.5, 1.5, (n, 3, 1)),
                       "acceleration_bounds": np.array(BOUNDS) * random.uniform(1, 3, (n, 3, 1))}
        self.cars = {"wheelbase": random.uniform(.2, 2, n), "steering_limit": random.uniform(0, 1, n),
                     "steering_rate": random.uniform(0, 3, n)}
        self.noise = np.concatenate([some(0, 1e-3, 3, 1), some(0, .1, 3, 1), some(0, 2, 3, 1)], 2)
        self.crate = random.uniform(.1, 5, (n, 2))

    def vary(self, batch: st.Batch) -> None:
        """Gives them to a batch."""
        for name, values in self.robots.items():
            batch.vary(f"r*.{name}", values)
        for name, values in self.cars.items():
            batch.vary(f"r2.{name}", values)
        batch.vary("ranger.noise", self.noise)
        batch.vary("crate.mass", self.crate[:, 0])
        batch.vary("crate.floor_friction", self.crate[:, 1])

    def scene(self, i: int, seed: int = 0, **properties: Any) -> Scene:
        """The scene of world `i`."""
        def robot(k: int) -> dict[str, Any]:
            own = {name: values[i, k].tolist() for name, values in self.robots.items()}
            car = {name: float(values[i]) for name, values in self.cars.items()} if k == 2 else {}
            return {**kind(k), **own, **car}

        return made(robot, lambda k: {"noise": self.noise[i, k].tolist()},
                    {"mass": float(self.crate[i, 0]), "floor_friction": float(self.crate[i, 1])}, seed, **properties)


def kind(k: int) -> dict[str, Any]:
    """Properties of a robot that do not vary."""
    return {"drive": ("diff", "omni", "car")[k], "localization": ("odom", "gps", "odom")[k], "limit_acceleration": k > 0}


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("ray_model", ["cell", "exact"])
@pytest.mark.parametrize("contacts", ["outlines", "cells"])
def test_columns_share_a_scene(threads: int, ray_model: str, contacts: str) -> None:
    kinds = {"ray_model": ray_model, "contacts": contacts}
    n, random = 5, np.random.default_rng(2)
    batch = st.Batch.of(made(kind, **kinds), n, threads=threads)
    for episode in range(2):
        columns = Columns(n, episode)
        columns.vary(batch)
        batch.reset(np.arange(n) + 10 * episode)
        if episode == 0:
            own = [columns.scene(i, **kinds) for i in range(n)]
            assert batch.state_hashes() == [alone(of, seed, 0, False) for of, seed in zip(own, batch.seeds)], "unobserved"
            batch.teleport(np.array(batch.pose))  # the subscriptions of rangers follow
        assert len(set(batch.variant)) == 1
        check(batch, [columns.scene(i, **kinds) for i in range(n)], 15)
        worlds = [st.World.of(columns.scene(i, **kinds), seed=int(random.integers(99))) for i in range(n)]
        batch.reset([world.seed for world in worlds])
        fleets = [world.fleet() for world in worlds]
        for each in (batch, *fleets):
            drive(each)
        names = ["pose", "estimate", "velocity", "estimated_velocity", "estimate_covariance"]
        live = {name: batch.array(name) for name in names} | {"ranges": batch.ranges}
        alone_ = [{name: fleet.array(name) for name in names} | {"ranges": fleet.ranger(0).ranges} for fleet in fleets]
        for _ in range(8):
            batch.cmd[...] = random.uniform(-1, 1, batch.cmd.shape)
            batch.step(4)
            for i, world in enumerate(worlds):
                fleets[i].cmd[...] = batch.cmd[i]
                world.step(4)
                assert batch.state_hash(i) == world.state_hash()
                for name, values in live.items():
                    assert np.array_equal(values[i], alone_[i][name], equal_nan=True), name
        kept = batch.snapshot(1)
        fork, copied = batch.fork(1), copy.deepcopy(batch)
        batch.step(3)
        assert batch.explain() == [None] * n
        batch.restore(kept, [0, 1])
        batch.cmd[0] = batch.cmd[1]
        batch.step(3)
        worlds[1].step(3)
        fork.step(3)
        copied.step(3)
        hashes = {batch.state_hash(0), batch.state_hash(1), copied.state_hash(1), fork.state_hash()}
        assert hashes == {worlds[1].state_hash()}
        batch.set_map(2, walls(9))
        for each in (batch, pickle.loads(pickle.dumps(batch)), copied):
            each.reset(3)
            check(each, [columns.scene(i, **kinds, seed=9 * (i == 2 and each is not copied)) for i in range(n)], 9)
        batch.set_map(2, walls())


def test_states_have_the_values_until_the_next_reset() -> None:
    columns = Columns(3, 8)
    batch = st.Batch.of(made(kind), 3)
    plain = batch.state()
    columns.vary(batch)
    batch.reset(5)
    drive(batch)
    batch.step(4)
    states, hashes = batch.state(), batch.state_hashes()
    batch.load(states[[1, 2, 0]])
    assert batch.state_hashes() == [hashes[i] for i in (1, 2, 0)]
    batch.load(plain)
    batch.load(states[2], 0)
    batch.step(4)
    assert batch.state_hash(0) == alone(columns.scene(2), 5, 8)
    batch.reset(6)
    check(batch, [columns.scene(i) for i in range(3)], 8)


def test_noise_of_zero_draws_no_random_numbers() -> None:
    def wandering(noise: float) -> Scene:
        return made(lambda k: {"localization": "odom", "odom_noise": [noise] * 4, "ctrl": "stage/wander"})

    batch = st.Batch.of(wandering(.1), 3)
    batch.vary("r*.odom_noise", np.array([0, .1, 0]).reshape(3, 1, 1) * np.ones(4))
    batch.reset(4)
    batch.step(60)
    assert batch.explain() == [None] * 3 and set(batch.variant) == {1}
    assert batch.state_hashes() == [alone(wandering(noise), 4, 60, False) for noise in (0, .1, 0)]


def test_thousands_of_worlds_have_values_of_their_own() -> None:
    n = 5000
    columns = Columns(n, 5)
    batch = st.Batch.of(made(kind), n, threads=2)
    columns.vary(batch)
    batch.reset(np.arange(n))
    assert len(set(batch.variant)) == 1
    drive(batch)
    batch.step(8)
    hashes = batch.state_hashes()
    assert len(set(hashes)) == n
    for i in np.random.default_rng(1).choice(n, 40, replace=False).tolist():
        assert hashes[i] == alone(columns.scene(i), i, 8), i


@pytest.mark.parametrize("seed", range(2))
def test_columns_belong_to_worlds_that_leave_the_rows(seed: int) -> None:
    def with_camera(of: Scene) -> Scene:
        first, *others = of.models
        assert isinstance(first, Robot)
        camera = Model(model="camera", properties={"resolution": [8, 6]})
        return dataclasses.replace(of, models=[dataclasses.replace(first, sensors=[*first.sensors, camera]), *others])

    columns = Columns(4, seed)
    batch = st.Batch.of(with_camera(made(kind)), 4)
    columns.vary(batch)
    batch.reset(5)
    drive(batch)
    batch.step(4)
    worlds = [st.World.of(with_camera(columns.scene(i)), seed=5) for i in range(4)]
    fleets = [world.fleet() for world in worlds]
    for fleet, world in zip(fleets, worlds):
        drive(fleet)
        world.step(4)
    for of in (batch, *fleets):
        _ = of.sensor("camera").depth
    assert None not in batch.explain()
    batch.step(4)
    for i, world in enumerate(worlds):
        world.step(4)
        assert batch.state_hash(i) == world.state_hash()
    batch.reset(6)
    assert None not in batch.explain()
    drive(batch)
    batch.step(9)
    for i in range(4):
        world = st.World.of(with_camera(columns.scene(i)), seed=6)
        fleet = world.fleet()
        drive(fleet)
        _ = fleet.sensor("camera").depth
        world.step(9)
        assert batch.state_hash(i) == world.state_hash()


def test_many_worlds_with_values_each_in_each_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stagesim._scene_variants.KEPT", 4)
    batch = st.Batch.of(made(), 40, threads=2)
    for episode in range(4):
        widths = np.random.default_rng(episode).uniform(.1, .2, (40, 1, 3))
        batch.vary("r*.size", widths)
        batch.reset(episode)
        assert len(set(batch.variant)) == 40
        check(batch, [made(lambda _: {"size": width[0].tolist()}) for width in widths], 5)
    assert len(batch._recipes) <= 90


def test_many_scenes_leave_files_to_others() -> None:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    base = dataclasses.replace(made(), map=GridMap(np.random.default_rng(3).random((120, 120)) < 0.1, 0.1))
    opened = []
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (200, limits[1]))
        batch = st.Batch.of(base, 130)
        batch.vary("crate.mass", np.arange(1., 131))
        batch.reset(3)
        opened = [open(os.devnull, "rb") for _ in range(40)]
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
        for file in opened:
            file.close()
    crates = [dataclasses.replace(base.models[-1], mass=float(mass)) for mass in range(1, 131)]
    check(batch, [dataclasses.replace(base, models=[*base.models[:-1], crate]) for crate in crates], 3)


def test_mistakes_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_variation, "MOST_COMBINATIONS", 2)
    batch = st.Batch.of(made(), 3)
    before = batch.state_hashes()
    good = np.ones(3)
    mistakes: list[tuple[Any, Any, type[Exception], str]] = [
        ("robt.mass", good, ValueError, "vary('robt.mass'): found nothing with a name or type like 'robt', expected \"world\""),
        ("cratee.mass", good, ValueError, "vary('cratee.mass'): found nothing with a name or type like 'cratee', expected "
         "\"world\", or a model of the world file; did you mean 'crate'?"),
        ("r*.masss", good, ValueError, "vary('r*.masss'): found the property 'masss', which 'r*' lacks, expected one of "
         "docs/properties.md; did you mean 'mass'?"),
        ("crate.odom_noise", np.ones((3, 1, 4)), ValueError, "vary('crate.odom_noise'): nothing reads \"odom_noise\""),
        ("crate.samples", good, ValueError, "vary('crate.samples'): nothing reads \"samples\" of what it chooses"),
        ("r1.watts", [1, 1, -1.], ValueError, "vary('r1.watts'): found a negative number, expected 0 or more, in world 2"),
        ("r*.name", good, ValueError, "vary('r*.name'): found the property 'name', which 'r*' lacks"),
        ("mass", good, ValueError, "vary(): found 'mass', expected PATTERN.PROPERTY or PATTERN.PROPERTY[INDEX], such as"),
        (3, good, TypeError, "vary(): found 3, expected PATTERN.PROPERTY"),
        ("r*.mass", good[:2], ValueError, "vary('r*.mass'): found the shape (2,), expected (3,), (3, 3) or (3, 3, 1): 3 worlds "
         "and 3 matches"),
        ("r*.mass", 1, ValueError, "vary('r*.mass'): found the shape (), expected (3,)"),
        ("r*.mass", np.ones((3, 2)), ValueError, "vary('r*.mass'): found the shape (3, 2), expected"),
        ("ranger.noise", good, ValueError, "vary('ranger.noise'): found the shape (3,), expected (3, 3, 3): 3 worlds and 3 "
         "matches, or [0] to [2] after the name for one of the numbers"),
        ("r*.mass", [1, np.nan, 1], ValueError, "vary('r*.mass'): found NaN for world 1, expected a number"),
        ("r*.mass", [1, 2, -1.], ValueError, "vary('r*.mass'): found -1.0 for world 2, expected kilograms, 0 or more"),
        ("r*.mass", [1, 2, np.inf], ValueError, "vary('r*.mass'): found inf for world 2, expected kilograms, 0 or more"),
        ("r*.mass", [1, 1j, 2], TypeError, "vary('r*.mass'): found values of the type complex128, expected numbers"),
        ("ranger.noise[1]", -good, ValueError, "vary('ranger.noise[1]'): found -1.0 for world 0, expected one of three numbers"),
        ("ranger.samples", good, TypeError, "vary('ranger.samples'): found 1.0 for world 0, expected a whole number, 0 to"),
        ("r*.drive", ["fly"] * 3, ValueError, "vary('r*.drive'): found 'fly' for world 0, expected 'diff' or 'omni' or 'car'"),
        ("r*.velocity_bounds[1]", good, ValueError, "vary('r*.velocity_bounds[1]'): found 0 values of 'velocity_bounds' in the "
         "world file, expected more than 1; give all of them instead"),
        ("r*.size", np.array([.1, .2, .3]).reshape(3, 1, 1) * np.ones(3), ValueError, "vary('r*.size'): found 3 worlds that all "
         "differ, expected up to 2 different"),
        ("r*.mass", None, ValueError, "vary('r*.mass'): found a name that is not varied, expected one that is"),
    ]
    for name, values, kind, message in mistakes:
        with pytest.raises(kind) as caught:
            batch.vary(name, values)
        assert str(caught.value).startswith(message) and "\n" not in str(caught.value)
    batch.reset()
    assert batch.state_hashes() == before and batch.variant.tolist() == [0] * 3 and batch.varied == {}
    batch.vary("r*.mass", good)
    with pytest.raises(ValueError, match=r"expected 'r\*.mass'; did you mean 'r\*.mass'\?$"):
        batch.vary("r.mass", None)


def test_values_that_do_not_go_together_are_told_by_the_reset() -> None:
    batch = st.Batch.of(made(), 3)
    _ = batch.ranges
    before = batch.state_hashes()
    turned = np.array([BOUNDS, BOUNDS, [.5, -.5, *BOUNDS[2:]]])[:, None]
    for name, values, kind, message in [
            ("r*.velocity_bounds", turned, st.WorldError, "values of vary() can't be in force: found the minimum above the "
             "maximum, expected the minimum first, in world 2"),
            ("ranger.samples", [9, 9, 10], st.StageError, "the scene doesn't fit into this batch, because the ranges of its "
             "ranger need 10 places, and the array has 9")]:
        batch.vary(name, values)
        with pytest.raises(kind) as caught:
            batch.reset(5)
        assert str(caught.value) == message
        assert batch.state_hashes() == before
        batch.vary(name, None)
    batch.reset(6)
    check(batch, [made()] * 3)


def test_forks_have_values_of_which_the_file_has_none() -> None:
    """Rangers of arena.world have no noise, and only one of its numbers is given."""
    batch = st.Batch("arena.world", 3)
    batch.vary("ranger.noise[0]", np.array([0.01, 0.02, 0]))
    batch.reset([1, 2, 3])
    assert batch.ranger(0).ranges.shape == (3, 5, 32)
    batch.step(3)
    forks = [batch.fork(i) for i in range(3)]
    assert [fork.state_hash() for fork in forks] == batch.state_hashes()
    assert [world.state_hash() for world in pickle.loads(pickle.dumps(forks))] == batch.state_hashes()
    for fork in forks:
        fork.step(4)
    batch.step(4)
    assert [fork.state_hash() for fork in forks] == batch.state_hashes()
