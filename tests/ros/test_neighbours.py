# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages of radios with range and bearing, and the things that robots touch."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import stagesim as st
from ros_testing import Client, node_here, time_of
from sensor_msgs.msg import PointCloud2, PointField
from stagesim.ros.neighbours import RECEIVED
from visualization_msgs.msg import Marker, MarkerArray

TYPES = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8", PointField.INT32: "i4", PointField.UINT8: "u1"}


def points_of(cloud: PointCloud2) -> np.ndarray:
    """Reads a cloud by its own description."""
    kind = np.dtype({"names": [field.name for field in cloud.fields],
                     "formats": [(TYPES[field.datatype], field.count) if field.count > 1 else TYPES[field.datatype]
                                 for field in cloud.fields],
                     "offsets": [field.offset for field in cloud.fields], "itemsize": cloud.point_step})
    assert len(cloud.data) == cloud.row_step * cloud.height == cloud.point_step * cloud.width
    return np.frombuffer(cloud.data, kind)


def test_radios_tell_range_and_bearing(client: Client, tmp_path: Path) -> None:
    file = tmp_path / "r.world"
    file.write_text("""
define bot position( size [0.2 0.2 0.2] localization "gps" radio( range 5 ) )
bot( name "a" pose [0 0 0 90] )
bot( name "b" pose [3 4 0 0] )
bot( name "c" pose [0 -1 0 0] )
bot( name "far" pose [20 0 0 0] )
""")
    with st.World(file) as world, node_here(world) as node:
        clouds = client.listen(PointCloud2, "/a/range_and_bearing")

        def listen() -> bool:
            node.advance()
            return bool(clouds)

        client.until(listen)
        client.spin(0.1)
        node.team.fleet.send(np.array([[1, 2], [3, 4]], np.uint8), [1, 2])
        node.advance()
        client.until(lambda: time_of(clouds[-1]) == node.now and clouds[-1].width)
        points = points_of(clouds[-1])
        radios = {model.parent.name: model.id for model in world.models if model.type == "radio"}
        assert list(points["sender"]) == [radios["c"], radios["b"]]
        assert points["range"] == pytest.approx([1, 5])
        assert np.cos(points["bearing"]) == pytest.approx([-1, 0.8]) and points["bearing"][1] < 0
        assert np.allclose(np.stack([points["x"], points["y"]], 1), [[-1, 0], [4, -3]], atol=1e-6)
        assert list(points["size"]) == [2, 2] and points["data"][:, :3].tolist() == [[3, 4, 0], [1, 2, 0]]
        assert clouds[-1].header.frame_id == "a/radio_link" and points.dtype.itemsize == RECEIVED.itemsize
        # A step later there is nothing.
        node.advance()
        client.until(lambda: time_of(clouds[-1]) == node.now)
        assert clouds[-1].width == 0


def test_contacts_name_what_a_robot_touches(client: Client, tmp_path: Path) -> None:
    file = tmp_path / "c.world"
    file.write_text("""
model( name "wall" pose [0.5 0 0 0] size [0.1 4 1] )
define bot position( size [0.4 0.4 0.4] drive "omni" localization "gps" )
bot( name "a" pose [0 0 0 90] )
bot( name "b" pose [0 -2 0 0] )
""")
    with st.World(file) as world, node_here(world) as node:
        got = {name: client.listen(MarkerArray, f"/{name}/contacts") for name in "ab"}

        def listen() -> bool:
            node.team.fleet.cmd[0] = (0.0, -0.5, 0.0)  # to the right, to the wall
            node.advance()
            return len(got["a"]) > 20 and len(got["b"]) > 20

        client.until(listen)
        client.spin(0.1)
        touches = [marker for marker in got["a"][-1].markers if marker.action == Marker.ADD]
        assert touches and {marker.text for marker in touches} == {"wall"}
        for marker in touches:
            place, turned = marker.pose.position, marker.pose.orientation
            assert place.y == pytest.approx(-0.2, abs=2e-3) and abs(place.x) <= 0.2 + 1e-3
            assert 2 * math.atan2(turned.z, turned.w) == pytest.approx(-math.pi / 2, abs=1e-3)
            assert marker.header.frame_id == "a/base_footprint"
        assert [marker.action for marker in got["b"][-1].markers] == [Marker.DELETEALL]
