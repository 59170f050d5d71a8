# SPDX-License-Identifier: GPL-2.0-or-later
"""The URDF of robots, compared with the frames that the node publishes."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import stagesim as st
from rcl_interfaces.srv import GetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_testing import Client, node_here, time_of
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from stagesim.ros.description import angles_of
from stagesim.ros.solids import Solid, inertia_of

TFMessage = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros").TFMessage
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
ROBOT = """
define eye ranger( size [0.1 0.1 0.1] pose [0.1 0 0 20] sensor( range [0 5] fov 90 samples 5 pose [0.1 0 0.05 0] ) )
define bot position( size [0.5 0.4 0.3] {} eye()
  camera( pose [0.1 0 0 0] pantilt [10 5] resolution [8 6] range [0.2 8] fov [40 30] ) )
bot( name "a" )
"""


def numbers(element: ElementTree.Element, path: str, name: str) -> list[float]:
    found = element.find(path)
    assert found is not None
    return [float(text) for text in found.attrib[name].split()]


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """The matrix of fixed angles, as URDF defines them."""
    matrices = []
    for axis, angle in enumerate((roll, pitch, yaw)):
        matrix, c, s = np.eye(3), math.cos(angle), math.sin(angle)
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
        matrices.append(matrix)
    return matrices[2] @ matrices[1] @ matrices[0]


def matrix_of(x: float, y: float, z: float, w: float) -> np.ndarray:
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


@pytest.mark.parametrize(("options", "prefix"), [({}, ""), ({"enforce_prefixes": True}, "a/"),
                                                ({"enforce_prefixes": True, "namespaced_tf": "also"}, "")])
def test_joints_are_the_fixed_transforms(client: Client, tmp_path: Path, options: dict[str, object], prefix: str) -> None:
    file = tmp_path / "a.world"
    file.write_text(ROBOT.format(""))
    space = "/a" if options else ""
    with st.World(file) as world, node_here(world, **options) as node:
        texts = client.listen(String, f"{space}/robot_description", KEPT)
        fixed = client.listen(TFMessage, "/a/tf_static" if "namespaced_tf" in options else "/tf_static", KEPT)
        client.until(lambda: texts and fixed)
        assert node.get_parameter("a.robot_description" if options else "robot_description").value == texts[0].data
    root = ElementTree.fromstring(texts[0].data.encode())
    assert root.tag == "robot" and root.attrib["name"] == "a"
    joints = {joint.find("child").attrib["link"]: joint for joint in root.findall("joint")}
    links = [link.attrib["name"] for link in root.findall("link")]
    assert len(set(links)) == len(links) == len(joints) + 1 and set(links) - set(joints) == {prefix + "base_footprint"}
    assert {joint.find("parent").attrib["link"] for joint in joints.values()} <= set(links)
    for transform in fixed[0].transforms:
        joint = joints.pop(transform.child_frame_id)
        place, turned = transform.transform.translation, transform.transform.rotation
        assert joint.attrib["type"] == "fixed"
        assert joint.find("parent").attrib["link"] == transform.header.frame_id
        assert numbers(joint, "origin", "xyz") == pytest.approx([place.x, place.y, place.z], abs=1e-7)
        assert np.allclose(rotation(*numbers(joint, "origin", "rpy")),
                           matrix_of(turned.x, turned.y, turned.z, turned.w), atol=1e-7)
    assert set(joints) == {f"{prefix}{side}_wheel_link" for side in ("left", "right")}


def test_bodies_are_boxes_and_cylinders(ros: None, tmp_path: Path) -> None:
    file = tmp_path / "a.world"
    file.write_text('''position( name "a" round 1 size [0.4 0.4 0.3] gui_nose 0
  model( pose [0.1 0.05 0 20] size [0.2 0.1 0.15] color "red" ) )''')
    with st.World(file) as world, node_here(world) as node:
        root = ElementTree.fromstring(node.get_parameter("robot_description").value)
    base = next(link for link in root.findall("link") if link.attrib["name"] == "base_link")
    for kind in ("visual", "collision"):
        body, box = sorted(base.findall(kind), key=lambda part: part.find("geometry/box") is not None)
        assert numbers(body, "geometry/cylinder", "radius") == pytest.approx([0.2], abs=1e-6)
        assert numbers(body, "geometry/cylinder", "length") == pytest.approx([0.3], abs=1e-6)
        assert numbers(box, "origin", "xyz") == pytest.approx([0.1, 0.05, 0.375], abs=1e-6)
        turned = numbers(box, "origin", "rpy")[2] - math.radians(20)
        size = numbers(box, "geometry/box", "size")
        assert (turned + 1e-6) % (math.pi / 2) < 1e-5
        assert (size if abs(math.cos(turned)) > 0.5 else [size[1], size[0], size[2]]) == pytest.approx(
            [0.2, 0.1, 0.15], abs=1e-5)
    assert numbers(box if kind == "visual" else base.findall("visual")[1], "material/color", "rgba") == [1, 0, 0, 1]


def test_a_car_has_wheels_that_steer(ros: None, tmp_path: Path) -> None:
    file = tmp_path / "a.world"
    file.write_text(ROBOT.format('drive "car" wheelbase 0.3'))
    with st.World(file) as world, node_here(world, wheel_radius=0.1) as node:
        root = ElementTree.fromstring(node.get_parameter("robot_description").value)
    joints = {joint.attrib["name"]: joint for joint in root.findall("joint")}
    steers = joints["front_right_steering_joint"]
    assert steers.attrib["type"] == "revolute" and numbers(steers, "axis", "xyz") == [0, 0, 1]
    assert numbers(steers, "origin", "xyz") == pytest.approx([0.3, -0.2, 0.1])
    rolls = joints["front_right_wheel_joint"]
    assert rolls.attrib["type"] == "continuous" and rolls.find("parent").attrib["link"] == "front_right_steering_link"
    assert numbers(joints["rear_left_wheel_joint"], "origin", "xyz") == pytest.approx([0, 0.2, 0.1])


ARM = """
define eye ranger( size [0.1 0.1 0.1] pose [0.15 0 0 20] mass 0.5 sensor( range [0 5] fov 90 samples 5 pose [0.1 0 0.05 0] ) )
position( name "a" size [0.5 0.4 0.3] mass 6 update_interval 100
  actuator( pose [0.1 0.05 0 30] size [0.3 0.1 0.1] mass 2 type "linear" axis [1 2 2] min_position -0.2 max_position 0.3
    start_position 0.1 max_speed 0.7
    actuator( pose [0.1 0 0 -50] size [0.2 0.2 0.1] type "rotational" min_position -7 max_position 7 max_speed 5 eye() ) )
  actuator( pose [-0.1 0 0 0] type "rotational" start_position 1 min_position -1 max_position 2 ) )
"""


def pose_by(joint: ElementTree.Element, position: float) -> np.ndarray:
    """The 4 x 4 matrix of a joint at a position."""
    made, axis = np.eye(4), np.array(numbers(joint, "axis", "xyz")) if joint.find("axis") is not None else np.zeros(3)
    made[:3, :3], made[:3, 3] = rotation(*numbers(joint, "origin", "rpy")), numbers(joint, "origin", "xyz")
    if joint.attrib["type"] == "prismatic":
        made[:3, 3] += made[:3, :3] @ axis * position
    if joint.attrib["type"] == "revolute":
        assert tuple(axis) == (0, 0, 1)
        made[:3, :3] = made[:3, :3] @ rotation(0, 0, position)
    return made


def test_actuators_are_joints_that_agree_with_tf(client: Client) -> None:
    random = np.random.default_rng(1)
    with st.World.from_text(ARM) as world, node_here(world) as node:
        actuators = [model for model in world.models if model.type == "actuator"]
        states, moving = client.listen(JointState, "/joint_states"), client.listen(TFMessage, "/tf")
        fixed, texts = client.listen(TFMessage, "/tf_static", KEPT), client.listen(String, "/robot_description", KEPT)
        client.until(lambda: node.advance() and states and moving and fixed and texts)
        for _ in range(8):
            for actuator, (low, high) in zip(actuators, ((-0.2, 0.3), (-7, 7), (-1, 2))):
                actuator.move_actuator(random.uniform(low, high))
            for _ in range(10):
                node.advance()
        client.until(lambda: time_of(states[-1]) == node.now and time_of(moving[-1]) == node.now)
    root = ElementTree.fromstring(texts[0].data.encode())
    joints = {joint.attrib["name"]: joint for joint in root.findall("joint")}
    limits = joints["actuator0_joint"].find("limit").attrib
    assert (limits["lower"], limits["upper"], limits["velocity"]) == ("-0.2", "0.3", "0.7")
    assert {joints[f"actuator{i}_joint"].attrib["type"] for i in (1, 2)} == {"revolute"}
    by_stamp = {time_of(message): dict(zip(message.name, zip(message.position, message.velocity))) for message in states}
    transforms = {t.child_frame_id: (0, t) for t in fixed[0].transforms}
    compared, seen, before = 0, set(), None
    for message in moving:
        stamp = time_of(message)
        for t in [*(t for _, t in transforms.values()), *message.transforms]:
            joint = joints.get(t.child_frame_id.removesuffix("_link") + "_joint", joints.get(f"{t.child_frame_id}_joint"))
            if joint is None or stamp not in by_stamp:
                continue
            assert joint.find("parent").attrib["link"] == t.header.frame_id
            place, turned = t.transform.translation, t.transform.rotation
            made = pose_by(joint, by_stamp[stamp].get(joint.attrib["name"], (0.0,))[0])
            assert made[:3, 3] == pytest.approx([place.x, place.y, place.z], abs=1e-7)
            assert np.allclose(made[:3, :3], matrix_of(turned.x, turned.y, turned.z, turned.w), atol=1e-7)
            compared += joint.attrib["type"] != "fixed"
        if stamp in by_stamp:
            seen.add(round(by_stamp[stamp]["actuator1_joint"][0], 3))
    assert compared > 30 and len(seen) > 10 and max(map(abs, seen)) > math.pi  # whole turns count
    times = sorted(by_stamp)
    for before, after in zip(times, times[1:]):
        moved = by_stamp[after]["actuator0_joint"][0] - by_stamp[before]["actuator0_joint"][0]
        assert abs(moved) <= 0.7 * (after - before) / 1e6 + 1e-9


def test_masses_and_inertia_are_those_of_the_model(ros: None) -> None:
    with st.World.from_text(ARM) as world, node_here(world) as node:
        root = ElementTree.fromstring(node.get_parameter("robot_description").value)
    masses = {link.attrib["name"]: numbers(link, "inertial/mass", "value")[0] for link in root.findall("link")
              if link.find("inertial") is not None}
    assert masses == {"base_link": 6, "actuator0_link": 2, "actuator1_link": 0.5}
    base = next(link for link in root.findall("link") if link.attrib["name"] == "base_link")
    assert numbers(base, "inertial/origin", "xyz") == pytest.approx([0, 0, 0.15], abs=1e-6)
    for name, (one, other) in {"ixx": (0.4, 0.3), "iyy": (0.5, 0.3), "izz": (0.5, 0.4)}.items():
        assert numbers(base, "inertial/inertia", name)[0] == pytest.approx(6 / 12 * (one**2 + other**2), rel=1e-5)


@pytest.mark.parametrize(("mass", "expected"), [("", 10.0), ("mass 3", 3.0)])
def test_a_robot_without_a_mass_has_that_of_contacts(ros: None, mass: str, expected: float) -> None:
    with st.World.from_text(f'position( name "a" size [0.4 0.4 0.2] round 1 {mass} )') as world, node_here(world) as node:
        root = ElementTree.fromstring(node.get_parameter("robot_description").value)
    assert numbers(root, "link/inertial/mass", "value") == [expected]
    assert numbers(root, "link/inertial/inertia", "izz")[0] == pytest.approx(expected * 0.2**2 / 2, rel=1e-5)
    assert numbers(root, "link/inertial/inertia", "ixx")[0] == pytest.approx(
        expected * (0.2**2 / 4 + 0.2**2 / 12), rel=1e-5)


def test_the_inertia_of_parts_adds_up() -> None:
    """A box of two halves, one of them turned by 90 degrees, has the inertia of the whole box."""
    halves = [Solid(False, (0.5, 0.6, 0.2), (0.25, 0.1, 0.3)), Solid(False, (0.6, 0.5, 0.2), (0.75, 0.1, 0.3), math.pi / 2)]
    middle, inertia = inertia_of(3.0, halves)
    assert middle == pytest.approx([0.5, 0.1, 0.3])
    assert inertia == pytest.approx(np.diag([0.36 + 0.04, 1 + 0.04, 1 + 0.36]) * 3 / 12)
    turned = inertia_of(1.0, [Solid(False, (1.0, 0.2, 0.1), (0.0, 0.0, 0.0), 0.3)])[1]
    assert np.linalg.eigvalsh(turned) == pytest.approx(np.sort([0.05, 1.01, 1.04]) / 12)
    assert turned[0, 1] == pytest.approx((0.04 - 1) / 24 * math.sin(0.6))


def test_a_given_description_is_published_instead(ros: None, one: str) -> None:
    with st.World(one) as world, node_here(world, robot_description="<robot name='real'/>") as node:
        assert node.get_parameter("robot_description").value == "<robot name='real'/>"


def test_angles_of_rotations() -> None:
    for roll, pitch, yaw in np.random.default_rng(1).uniform(-1.5, 1.5, (20, 3)):
        half = [(math.sin(angle / 2), math.cos(angle / 2)) for angle in (roll, pitch, yaw)]
        (a, A), (b, B), (c, C) = half
        quaternion = np.array([a * B * C - A * b * c, A * b * C + a * B * c, A * B * c - a * b * C, A * B * C + a * b * c])
        assert angles_of(quaternion) == pytest.approx([roll, pitch, yaw])
