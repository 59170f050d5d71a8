# SPDX-License-Identifier: GPL-2.0-or-later
"""Logs that the node writes: --log and the parameter log_file."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any, Callable

import pytest
from geometry_msgs.msg import Twist
from ros_testing import TWO, Client, Process
from stagesim import _paths

reader = pytest.importorskip("mcap.reader")
DecoderFactory = pytest.importorskip("mcap_ros2.decoder").DecoderFactory


def messages(file: Path) -> list[tuple[str, int, bytes]]:
    """All messages in their order: topic, time and bytes."""
    with open(file, "rb") as stream:
        return [(channel.topic, message.log_time, message.data)
                for _, channel, message in reader.make_reader(stream).iter_messages(log_time_order=False)]


def always_on(folder: Path) -> Path:
    """A world file in which all sensors run without subscribers."""
    file = folder / "two.world"
    file.write_text(TWO.replace('localization "odom"', 'localization "odom" alwayson 1').replace("eye ranger(",
                                                                                                "eye ranger( alwayson 1"))
    return file


def test_the_log_of_the_node_is_that_of_the_program(tmp_path: Path, start: Callable[..., Process]) -> None:
    file = always_on(tmp_path)
    start(str(file), "--duration", "1", "--seed", "3", "--stats", "--log", str(tmp_path / "node.mcap"), speed=0).statistics()
    subprocess.run([_paths.PROGRAM, "-g", "--duration", "1", "--seed", "3", "--log", tmp_path / "program.mcap", file],
                   check=True, capture_output=True)
    found = messages(tmp_path / "node.mcap")
    assert found == messages(tmp_path / "program.mcap")
    assert {"/a/base_scan_sensor_1", "/b/odom", "/a/cmd_vel", "/a/battery", "/tf", "/clock"} <= {topic for topic, *_ in found}


def test_commands_of_clients_are_in_the_log(tmp_path: Path, start: Callable[..., Process], client: Client) -> None:
    log = tmp_path / "run.mcap"
    process = start(str(always_on(tmp_path)), paused=True, log_file=str(log))
    driver = client.talk(Twist, "a/cmd_vel")
    client.step(2)
    command = Twist()
    command.linear.x, command.angular.z = 0.25, -0.5
    driver.publish(command)
    client.spin(0.3)
    client.step(2)
    assert process.end()[0] == 0
    obeyed: list[tuple[int, Any]] = []
    with open(log, "rb") as stream:
        for *_, message, twist in reader.make_reader(
                stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(topics=["/a/cmd_vel"]):
            obeyed.append((message.log_time // 10**8, (twist.twist.linear.x, twist.twist.angular.z)))
    assert obeyed == [(1, (0, 0)), (2, (0, 0)), (3, (0.25, -0.5)), (4, (0.25, -0.5))]


def test_a_log_that_cannot_be_written_ends_the_node(tmp_path: Path, start: Callable[..., Process]) -> None:
    status, text = start(str(always_on(tmp_path)), log_file=str(tmp_path / "none" / "run.mcap")).wait()
    assert status == 1 and "can't be written: No such file or directory" in text
    assert len([line for line in text.splitlines() if line.startswith("stagesim.ros: ")]) == 1
