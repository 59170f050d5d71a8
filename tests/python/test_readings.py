# SPDX-License-Identifier: GPL-2.0-or-later
"""The arrays of all readings of all types of sensors: in a world, in a batch, restored, deleted, from a plug-in."""

from __future__ import annotations

from pathlib import Path
from typing import Callable

import numpy as np
import pytest
import stagesim as st
from stagesim import env

ROOT = Path(__file__).resolve().parents[2]
#: Robot "b" has smaller sensors than "a", and "c" has none.
TEXT = """
resolution 0.02
interval_sim 100
plugins "sonar_ring"
model( name "wall" pose [3 0 0 0] size [0.1 8 1] color "red" fiducial_return 9 )
define all position( size [0.4 0.4 0.4] drive "omni"
  ranger( sensor( range [0 5] fov 90 samples $(samples) ) sensor( range [0 2] samples 1 ) )
  fiducial( range_max 8 range_max_id 8 fov 180 )
  blobfinder( range 8 fov 60 image [40 30] )
  bumper( bcount $(lines) blength 0.2 bpose[0] [0.22 0 0 0] )
  camera( resolution [$(pixels) 6] range [0.2 8] )
  sonar_ring( count $(samples) reach 4 ) )
"""
ROBOTS = """
{a}( name "a" pose [0 0 0 0] )
{b}( name "b" pose [0 2 0 30] )
position( name "c" pose [0 -2 0 180] size [0.4 0.4 0.4] )
"""
TYPES = ("ranger", "fiducial", "blobfinder", "bumper", "camera", "sonar_ring")
DEFINED = TEXT.index("define")
WORLD = TEXT[:DEFINED] + "".join(
    TEXT[DEFINED:].replace("define all", f"define {name}").replace("$(samples)", samples).replace("$(lines)", lines)
    .replace("$(pixels)", pixels)
    for name, samples, lines, pixels in (("large", "7", "2", "8"), ("small", "5", "1", "4"))) + ROBOTS.format(
        a="large", b="small")
#: The shapes of robots' rows, with lists of at most three detections.
SHAPES = {
    "ranger": {"ranges": (8,), "intensities": (8,), "values": (8,), "bearings": (8,), "origins": (8, 2)},
    "fiducial": {"count": (), "id": (3,), "range": (3,), "bearing": (3,), "heading": (3,)},
    "blobfinder": {"count": (), "color": (3, 4), "box": (3, 4), "range": (3,)},
    "bumper": {"hit": (2,)}, "camera": {"color": (6, 8, 3), "depth": (6, 8)}, "sonar_ring": {"ranges": (7,)}}
READINGS = [(kind, name) for kind in TYPES for name in (*SHAPES[kind], "time")]


def arrays(crowd: st.Fleet | st.Batch) -> dict[tuple[str, str], np.ndarray]:
    """All readings of all types, by type and name."""
    return {(kind, name): getattr(crowd.sensor(kind, most=3), name) for kind, name in READINGS}


def copies(views: dict[tuple[str, str], np.ndarray]) -> dict[tuple[str, str], np.ndarray]:
    return {key: view.copy() for key, view in views.items()}


def check_equal(found: dict[tuple[str, str], np.ndarray], expected: dict[tuple[str, str], np.ndarray]) -> None:
    for key, view in found.items():
        np.testing.assert_array_equal(view, expected[key], err_msg=str(key))


def is_empty(view: np.ndarray) -> bool:
    return bool(np.isnan(view).all() if view.dtype.kind == "f" else not view.any())


def test_types_declare_their_arrays() -> None:
    world = st.World.from_text(WORLD)
    types = st.sensor_types()
    fleet = world.fleet()
    for kind in TYPES:
        sensor = fleet.sensor(kind, most=3)
        assert sensor.readings == types[kind]
        assert [reading.name for reading in types[kind]] == list(SHAPES[kind])
        for reading in types[kind]:
            view = getattr(sensor, reading.name)
            assert (view.dtype, view.shape) == (np.dtype(reading.dtype), (3, *SHAPES[kind][reading.name]))
            assert not view.flags.writeable and reading.description and reading.name in dir(sensor)
            assert getattr(sensor, reading.name) is view and fleet.array(f"{kind}.{reading.name}").dtype == view.dtype
    assert st.Batch.of(world, 2).array("camera:0.color").shape == (2, 3, 6, 8, 3)


def test_rows_are_padded_and_empty_without_a_sensor() -> None:
    world = st.World.from_text(WORLD)
    views = arrays(world.fleet())
    world.step(3)
    for key, view in views.items():
        assert is_empty(view[2]), key
        # No bumper is touched, and the sensor has no response curve.
        assert not is_empty(view[0]) or key[0] == "bumper" or key == ("ranger", "values"), key
    assert np.isnan(views["ranger", "ranges"][1, 6:]).all() and not np.isnan(views["ranger", "ranges"][1, :6]).any()
    assert np.isnan(views["camera", "depth"][1, :, 4:]).all() and not np.isnan(views["camera", "depth"][1, :, :4]).any()
    assert not views["camera", "color"][1, :, 4:].any() and views["camera", "color"][1, 5, :4, 0].all()
    assert views["sonar_ring", "ranges"][0, 0] == pytest.approx(2.95, abs=0.04)
    assert views["fiducial", "id"][0].tolist() == [9, 0, 0]


def test_batches_have_the_arrays_of_their_worlds() -> None:
    batch = st.Batch.of(st.World.from_text(WORLD), 3, threads=2)
    views = arrays(batch)
    batch.cmd[:, :, 0] = [[0.1], [0.3], [0.5]]
    batch.step(12)
    for i in range(3):
        world = st.World.from_text(WORLD, seed=i)
        fleet = world.fleet()
        alone = arrays(fleet)
        fleet.cmd[:, 0] = batch.cmd[i, :, 0]
        world.step(12)
        check_equal({key: view[i] for key, view in views.items()}, alone)


def test_restored_worlds_have_the_arrays_of_the_snapshot() -> None:
    world = st.World.from_text(WORLD)
    fleet = world.fleet()
    views = arrays(fleet)
    fleet.cmd[:, 0] = 0.4
    world.step(5)
    snapshot, before = world.snapshot(), copies(views)
    world.step(20)
    assert (views["ranger", "ranges"] != before["ranger", "ranges"])[0].any()
    world.restore(snapshot)
    check_equal(views, before)


@pytest.mark.parametrize("kind", TYPES)
def test_rows_of_deleted_sensors_are_empty(kind: str) -> None:
    world = st.World.from_text(WORLD)
    views = arrays(world.fleet())
    world.step(3)
    before = copies(views)
    world.model(f"a.{kind}:0").delete()
    for key, view in views.items():
        if key[0] == kind:
            assert is_empty(view[0]), key
        else:
            np.testing.assert_array_equal(view[0], before[key][0])
        np.testing.assert_array_equal(view[1], before[key][1])
    world.step(2)
    assert is_empty(views[kind, "time"][0]) and not is_empty(views[kind, "time"][1])


def test_unknown_names() -> None:
    fleet = st.World.from_text(WORLD).fleet()
    with pytest.raises(AttributeError, match="found 'echo', expected a reading"):
        fleet.sensor("ranger").echo
    with pytest.raises(ValueError, match="found 'sonar', expected a type of sensor: .*ranger"):
        fleet.sensor("sonar")
    with pytest.raises(st.GoneError, match="no robot has a sonar_ring number 1"):
        fleet.sensor("sonar_ring", 1)
    for name in ("ranger.echo", "poses", "world", "ranger:x.ranges", "ranger"):
        with pytest.raises(ValueError):
            fleet.array(name)


def test_rollouts_record_any_reading() -> None:
    batch = st.Batch.of(st.World.from_text(WORLD), 2)
    batch.cmd[:, :, 0] = 0.2
    recorded = batch.rollout(moments=6, record=("sonar_ring.ranges", "bumper:0.hit", "ranges"))
    assert recorded["sonar_ring.ranges"].shape == (6, 2, 3, 7) and recorded["bumper:0.hit"].dtype == bool
    assert (recorded["sonar_ring.ranges"][-1] == batch.sensor("sonar_ring").ranges)[:, :2, :5].all()


#: A sensor with readings of all types of elements, and of none to three axes.
PLUGIN = """
#include "stage.hh"
using namespace Stg;
struct Everything : Model {
  Everything(World* w, Model* parent, const std::string& type) : Model(w, parent, type), five(5) {}
  void Update() override {
    n++;
    for (double& number : five) number += 0.5;
    Model::Update();
  }
  const std::vector<double>& Five() const { return five; }
  int32_t n = 0;
  std::vector<double> five;
};
static ReadingShape One(const Everything&) { return ReadingShape(); }
static ReadingShape Two(const Everything&) { return ReadingShape(2, 3); }
static ReadingShape Three(const Everything&) { return ReadingShape(2, 3, 4); }
static bool PutCount(const Everything& e, size_t, int32_t* to) { return *to = e.n, e.n > 1; }
static bool PutFlag(const Everything& e, size_t, bool* to) { return *to = e.n % 2 == 0, true; }
static bool PutFloats(const Everything& e, size_t rows, float* to) {
  for (size_t i = 0; i < 3 * rows; i++) to[i] = static_cast<float>(e.n) + static_cast<float>(i) / 8;
  return true;
}
static bool PutBytes(const Everything& e, size_t rows, uint8_t* to) {
  for (size_t i = 0; i < 12 * rows; i++) to[i] = static_cast<uint8_t>(e.n + static_cast<int>(i));
  return true;
}
static const bool registered = RegisterModelType(ModelTypeOf<Everything>("everything")
  .Reads(MakeReading("five", "K", "five", &Everything::Five)).Reads(MakeReading("count", "", "count", One, PutCount))
  .Reads(MakeReading("flag", "", "flag", One, PutFlag)).Reads(MakeReading("floats", "V", "floats", Two, PutFloats))
  .Reads(MakeReading("bytes", "", "bytes", Three, PutBytes)));
extern "C" bool used() { return registered; }
"""


def test_sensors_of_plugins_have_arrays_of_all_types(tmp_path: Path, plugin_of: Callable[[str, Path], Path]) -> None:
    plugin_of(PLUGIN, tmp_path / "everything.so")
    world = st.World.from_text(f'plugins "{tmp_path}/everything.so"\nposition( everything() )\nposition( pose [2 0 0 0] )')
    sensor = world.fleet().sensor("everything")
    assert [(r.name, r.dtype, r.unit) for r in sensor.readings] == [
        ("five", "float64", "K"), ("count", "int32", ""), ("flag", "bool", ""), ("floats", "float32", "V"),
        ("bytes", "uint8", "")]
    views = {reading.name: getattr(sensor, reading.name) for reading in sensor.readings}
    for n in range(1, 4):
        world.step()
        assert views["five"][0].tolist() == 5 * [n / 2] and np.isnan(views["five"][1]).all()
        assert views["count"].tolist() == [n if n > 1 else 0, 0] and views["flag"].tolist() == [n % 2 == 0, False]
        assert views["floats"][0].ravel().tolist() == [n + i / 8 for i in range(6)] and views["floats"].shape == (2, 2, 3)
        assert views["bytes"][0].ravel().tolist() == [n + i for i in range(24)] and views["bytes"].shape == (2, 2, 3, 4)
        assert not views["bytes"][1].any() and sensor.time[0] == pytest.approx(n / 10)


def test_environments_observe_any_reading() -> None:
    class BySonar(env.Navigate):
        ranges = "sonar_ring.ranges"

    task = BySonar()
    batch = st.Batch.of(st.World.from_text(WORLD), 2)
    scene = env.Scene(batch, st.World.from_text(WORLD), task.ranges)
    assert task.size(scene) == 5 + 7 and scene.ranges is batch.sensor("sonar_ring").ranges
    assert env.Scene(batch, scene.world).ranges is batch.ranges


def test_models_have_their_readings() -> None:
    world = st.World.from_text(WORLD)
    fleet = world.fleet()
    views = arrays(fleet)
    world.step(3)
    for kind in TYPES:
        model = world.model(f"a.{kind}:0")
        assert model.sensor_type == kind and list(model.readings) == list(SHAPES[kind])
        for reading in st.sensor_types()[kind]:
            found, row = model.readings[reading.name], views[kind, reading.name][0]
            assert found.dtype == row.dtype and found.ndim == row.ndim
            np.testing.assert_array_equal(found, row[:len(found)] if reading.is_list else row)
    assert world.model("a").sensor_type is None and world.model("a").readings == {}


def random_world(random: np.random.Generator) -> str:
    """Robots with rangers, bumpers, fiducial finders and blobfinders, and what they find."""
    def one(low: float, high: float) -> float:
        return round(random.uniform(low, high), 3)

    def rate() -> str:
        return f"update_interval {random.choice([50, 100, 200, 300])}" if several else ""

    several = random.random() < .5
    text = f"interval_sim {random.choice([50, 100])}\ncontacts \"{random.choice(['cells', 'outlines'])}\"\n"
    for i in range(6):
        text += (f"model( pose [{one(-3, 3)} {one(-3, 3)} 0 {one(0, 360)}] size [{one(.1, .6)} {one(.1, .6)} 1] "
                 f"fiducial_return {i} color \"{random.choice(['red', 'blue'])}\" pushable {random.integers(2)} )\n")
    for i in range(3):
        text += (f"position( name \"r{i}\" pose [{one(-1, 1)} {one(-1, 1)} 0 {one(0, 360)}] size [.3 .3 .4] {rate()} "
                 f"fiducial_return {10 + i} ranger( {rate()} sensor( range [0 3] samples 5 fov 90 ) ) "
                 f"fiducial( {rate()} range_max {one(1, 8)} range_max_id {one(1, 8)} fov {one(60, 360)} ) "
                 f"blobfinder( {rate()} range {one(1, 8)} fov {one(30, 120)} image [{random.integers(10, 60)} 30] ) "
                 f"bumper( {rate()} bcount 2 blength .2 bpose[0] [.16 0 0 0] bpose[1] [-.16 0 0 180] ) )\n")
    return text + "position( name \"blind\" pose [2 2 0 0] )\n"


def test_arrays_of_closed_worlds_equal_those_of_worlds() -> None:
    kinds = ("ranger", "fiducial", "blobfinder", "bumper")
    events: dict[str, int] = dict.fromkeys(kinds, 0)
    for seed in range(12):
        random = np.random.default_rng(seed)
        world = st.World.from_text(random_world(random))
        batch = st.Batch.of(world, 3, threads=1 + seed % 3)
        worlds = [batch.fork(i) for i in range(3)]
        fleets = [w.fleet() for w in worlds]
        most = int(random.integers(1, 9))
        names = [(kind, name) for kind in kinds for name in (*SHAPES[kind], "time")]
        found = {key: getattr(batch.sensor(key[0], most=most), key[1]) for key in names}
        alone = [{key: getattr(f.sensor(key[0], most=most), key[1]) for key in names} for f in fleets]
        snapshot = batch.snapshot(1)
        for moment in range(20):
            batch.cmd[...] = random.uniform((-.2, 0, -1), (.6, 0, 1), (3, 4, 3))
            for f, commands in zip(fleets, batch.cmd):
                f.cmd[...] = commands
            n = int(random.integers(1, 6))
            batch.step(n)
            for w in worlds:
                w.step(n)
            if moment % 7 == 5:
                batch.reset([seed + 100], ids=[0])
                worlds[0].reset(seed + 100)
                batch.restore(snapshot, 2)
                worlds[2].restore(snapshot)
            for i in range(3):
                check_equal({key: view[i] for key, view in found.items()}, alone[i])
            snapshot = batch.snapshot(1) if moment == 9 else snapshot
            events["ranger"] += int((found["ranger", "ranges"] < 3).sum())
            events["fiducial"] += int((found["fiducial", "count"] > 0).sum())
            events["blobfinder"] += int((found["blobfinder", "count"] > 0).sum())
            events["bumper"] += int(found["bumper", "hit"].sum())
        assert batch.state_hashes() == [w.state_hash() for w in worlds]
        assert batch.explain() == [None] * 3
        batch.reset()
        batch.step(3)
        assert batch._core.count_objects() == 0  # arrays were read without World objects
    assert min(events.values()) > 50, events
