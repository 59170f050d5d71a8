# SPDX-License-Identifier: GPL-2.0-or-later
"""Cameras, estimated poses, and the mounting of sensors."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st

TEXT = """
resolution 0.02
model( name "wall" pose [3 0 0 0] size [0.1 8 0.6] color_rgba [1 0 0 1] )
define eye camera( pose [0.1 0 0 0] range [0.2 6] fov [60 40] pantilt [10 5] update_interval 200 )
define rods ranger( pose [0.1 0 -0.2 90] origin [0 0 0 0] size [0.1 0.1 0.1]
  sensor( pose [0.2 0 0 90] size [0 0 0.06] range [0.1 5] fov 90 samples 5 )
  sensor( range [0 2] samples 1 ) )
define bot position( size [0.4 0.4 0.4] drive "omni" localization "odom" localization_origin [0 0 0 0]
  odom_error [0.1 0.1 0 0.1] joules 50 joules_capacity 200 )
bot( name "a" eye( resolution [8 6] ) rods() )
bot( name "b" pose [0 3 0 0] eye( resolution [4 10] ) bumper( bcount 3 ) )
bot( name "c" pose [0 -3 0 180] )
"""


def test_pictures() -> None:
    world = st.World.from_text(TEXT)
    camera = world.fleet().camera()
    assert camera.color.shape == (3, 10, 8, 3) and camera.depth.shape == (3, 10, 8)
    assert not camera.color.any() and np.isnan(camera.depth).all()
    world.step(2)
    a = camera.depth[0, :6]
    # The wall is 2.95 m ahead of the robot and 2.85 m ahead of the camera, and reaches up to the middle row. The
    # upper rows look over it, the lower rows at the floor in front of it.
    assert a[0] == pytest.approx(6) and a[2] == pytest.approx(2.85, abs=0.4) and (a[5] < 2).all()
    assert (camera.color[0, 2] == [255, 0, 0]).all() and (camera.color[0, 5] == [255, 255, 255]).all()
    # Pixels beyond a smaller image, and those of robots without a camera, are empty.
    assert np.isnan(camera.depth[0, 6:]).all() and np.isnan(camera.depth[1, :, 4:]).all()
    assert not np.isnan(camera.depth[1, :, :4]).any() and np.isnan(camera.depth[2]).all()
    assert not camera.color[0, 6:].any() and not camera.color[2].any()
    with pytest.raises(st.GoneError, match="no robot has a camera number 1"):
        world.fleet().camera(1)


def test_pictures_of_a_batch_are_those_of_its_worlds() -> None:
    batch = st.Batch("zoo.world", n=2, seeds=(3, 4), robots="watcher")
    color, depth = batch.camera().color, batch.camera().depth
    batch.step(n=20)
    for i, seed in enumerate((3, 4)):
        with st.World("zoo.world", seed=seed) as world:
            camera = world.fleet("watcher").camera()
            camera.color, camera.depth
            world.step(20)
            assert np.array_equal(color[i], camera.color) and np.array_equal(depth[i], camera.depth)


def test_views() -> None:
    world = st.World.from_text(TEXT)
    view = world.model("a.camera:0").view
    assert (view.width, view.height, view.near, view.far) == (8, 6, 0.2, 6)
    angles = (view.fov, view.vertical_fov, view.pan, view.tilt)
    assert np.degrees(angles) == pytest.approx([60, 40, -10, 5])
    view = st.World("zoo.world").model("watcher.blobfinder:0").view
    assert (view.width, view.height, view.far, view.pan, view.tilt) == (80, 60, 8, 0, 0)
    assert np.degrees(view.fov) == pytest.approx(90)
    with pytest.raises(TypeError, match="found a model of the type ranger, expected a camera or blobfinder"):
        world.model("a.ranger:0").view


def test_how_sensors_are_mounted() -> None:
    world = st.World.from_text(TEXT)
    ranger = world.model("a.ranger:0")
    assert ranger.pose_in_tree == pytest.approx((0.1, 0, 0.2, np.pi / 2))
    assert world.model("a").pose_in_tree == (0, 0, 0, 0)
    first, second = ranger.sensors
    assert first.pose == pytest.approx((0.2, 0, 0.03, np.pi / 2))
    assert (first.min_range, first.range, first.samples, second.range, second.samples) == (0.1, 5, 5, 2, 1)
    assert first.fov == pytest.approx(np.pi / 2)
    # The composed pose equals the origins in the fleet's arrays, for any pose of the robot.
    world.model("a").pose = (7, 5, 2)
    assert ranger.pose_in_tree == pytest.approx((0.1, 0, 0.2, np.pi / 2))
    assert world.fleet("a").ranger().origins[0, 0] == pytest.approx([0.1, 0.2])
    assert abs(world.fleet("a").ranger().bearings[0, 2]) == pytest.approx(np.pi)
    with pytest.raises(TypeError, match="expected a ranger"):
        world.model("a").sensors


def test_intervals_lines_and_packs() -> None:
    world = st.World.from_text(TEXT)
    assert world.model("a.camera:0").interval == 0.2 and world.model("a.ranger:0").interval == 0.1
    assert world.model("b.bumper:0").lines == 3
    with pytest.raises(TypeError, match="expected a bumper"):
        world.model("a").lines
    assert (world.model("a").energy, world.model("a").energy_capacity) == (50, 200)
    assert world.model("wall").energy_capacity is None


def test_estimates_err_as_the_odometry_does() -> None:
    world = st.World.from_text(TEXT)
    fleet = world.fleet()
    estimate = fleet.estimate
    fleet.cmd[:] = [0.3, 0.1, 0.2]
    world.step(20)
    assert estimate.shape == (3, 3) and not estimate.flags.writeable
    assert np.hypot(*(estimate[0] - fleet.pose[0])[:2]) > 1e-3
    assert st.World("simple.world").fleet("r0").estimate[0] == pytest.approx([0, -6, np.pi / 2], abs=1e-9)


def test_numbers_of_robots() -> None:
    world = st.World.from_text(TEXT)
    assert world.fleet("b").ids == (world.model("b").id,)
    assert [world.fleet().names[i] for i in range(3)] == ["a", "b", "c"]
