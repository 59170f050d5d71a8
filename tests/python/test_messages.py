# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages between robots as arrays: Fleet.send(), Fleet.messages(), and the readings of radios."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st

SWARM = """
define robot position( size [0.1 0.1 0.1] localization "gps"
  radio( range 3 ) radio( range 3 channel 1 ) )
robot( name "a" pose [0 0 0 0] )
robot( name "b" pose [2 0 0 90] )
robot( name "c" pose [4 0 0 180] )
radio( name "beacon" pose [0 1 0 0] range 1.5 )
"""


def swarm() -> tuple[st.World, st.Fleet]:
    """Three robots in a row, of which only the middle one hears both others."""
    world = st.World.from_text(SWARM)
    fleet = world.fleet()
    assert fleet.messages().receiver.shape == (0,)  # subscribes to the radios
    return world, fleet


def test_each_robot_hears_its_neighbours() -> None:
    world, fleet = swarm()
    fleet.send(np.array([[1, 2], [3, 4], [5, 6]], np.uint8))
    assert len(fleet.messages().receiver) == 0
    world.step()
    heard = fleet.messages()
    assert heard.receiver.tolist() == [0, 1, 1, 2]
    assert heard.sender.tolist() == [1, 0, 2, 1]
    assert heard.payload.shape == (4, 64)
    assert heard.payload[:, :3].tolist() == [[3, 4, 0], [1, 2, 0], [5, 6, 0], [3, 4, 0]]
    assert heard.size.tolist() == [2] * 4
    assert heard.range.tolist() == [2] * 4
    assert heard.sent.tolist() == [0] * 4
    # a is on the left of b, which looks in the direction of y, and c on its right.
    assert heard.bearing == pytest.approx([0, np.pi / 2, -np.pi / 2, 0])
    world.step()
    assert len(fleet.messages().receiver) == 0
    world.close()
    with pytest.raises(st.GoneError):
        fleet.messages()
    assert heard.payload[0, 0] == 3  # the arrays are copies


@pytest.mark.parametrize("which", [[2, 0], np.array([True, False, True])])
def test_some_robots_send(which: object) -> None:
    world, fleet = swarm()
    payload = [[9], [7]] if isinstance(which, list) else [[7], [9]]
    fleet.send(np.array(payload, np.uint8), which)
    world.step()
    heard = fleet.messages()
    assert heard.receiver.tolist() == [1, 1]
    assert dict(zip(heard.sender.tolist(), heard.payload[:, 0].tolist(), strict=True)) == {0: 7, 2: 9}


def test_bytes_go_to_all() -> None:
    world, fleet = swarm()
    fleet.send(b"hello")
    world.step()
    assert [bytes(row[:size]) for row, size in zip(*fleet.messages()[:-3:-1], strict=True)] == [b"hello"] * 4


def test_numbers_are_sent_as_bytes() -> None:
    world, fleet = swarm()
    numbers = np.array([[0.5, 1], [1.5, 2], [2.5, 3]])
    fleet.send(numbers.view(np.uint8))
    world.step()
    heard = fleet.messages()
    assert heard.payload.view(np.float64)[:, :2].tolist() == numbers[heard.sender].tolist()


def test_radios_are_numbered() -> None:
    world, fleet = swarm()
    fleet.messages(1)
    fleet.send(b"zero", [0])
    fleet.send(b"one", [2], index=1)
    world.step()
    assert (fleet.messages().sender.tolist(), fleet.messages(1).sender.tolist()) == ([0], [2])
    with pytest.raises(st.GoneError, match="no robot has a radio number 2"):
        fleet.send(b"", index=2)
    with pytest.raises(st.GoneError, match="no robot has a radio number 2"):
        fleet.messages(2)


def test_senders_outside_of_the_fleet_have_no_index() -> None:
    world, fleet = swarm()
    others = world.fleet([world.model("b"), world.model("c")])
    fleet.send(b"x")
    world.step()
    heard = others.messages()
    assert heard.receiver.tolist() == [0, 0, 1]
    assert heard.sender.tolist() == [-1, 1, 0]


def test_deleted_robots_neither_send_nor_receive() -> None:
    world, fleet = swarm()
    fleet.send(b"x")
    world.model("c").delete()
    world.step()
    heard = fleet.messages()
    assert (heard.receiver.tolist(), heard.sender.tolist()) == ([0, 1], [1, 0])
    fleet.send(b"y")
    world.step()
    world.model("a").delete()
    heard = fleet.messages()
    assert (heard.receiver.tolist(), heard.sender.tolist()) == ([1], [-1])


def test_readings_are_the_messages() -> None:
    world, fleet = swarm()
    radio = fleet.sensor("radio", most=2)
    fleet.send(b"hi")
    world.step()
    heard = fleet.messages()
    assert radio.count.tolist() == [1, 2, 1]
    assert radio.range[1].tolist() == heard.range[1:3].tolist()
    assert radio.bearing[1].tolist() == heard.bearing[1:3].tolist()
    assert radio.data[1].tolist() == heard.payload[1:3].tolist()
    assert np.isnan(radio.range[0, 1])


def test_messages_are_in_snapshots() -> None:
    world, fleet = swarm()
    fleet.send(b"hi")
    snapshot = st.Snapshot.from_bytes(world.snapshot().to_bytes())
    world.step()
    heard = [column.tolist() for column in fleet.messages()]
    world.step()
    world.restore(snapshot)
    assert len(fleet.messages().receiver) == 0
    world.step()
    assert [column.tolist() for column in fleet.messages()] == heard


@pytest.mark.parametrize(("payload", "error", "message"), [
    (bytes(65), ValueError, "found a message of 65 bytes, expected at most 64; send it in several parts"),
    (np.zeros((3, 65), np.uint8), ValueError, "found a message of 65 bytes"),
    (np.zeros(3), TypeError, r"found a payload of float64, expected bytes: use numbers.view\(numpy.uint8\)"),
    (np.zeros((1, 1, 1), np.uint8), ValueError, r"found a payload of shape \(1, 1, 1\), expected \(robots, bytes\)"),
    (np.zeros((2, 1), np.uint8), ValueError, "found 2 messages, expected one for each of 3 robots"),
])
def test_wrong_payloads_are_refused(payload: object, error: type[Exception], message: str) -> None:
    world, fleet = swarm()
    with pytest.raises(error, match=message):
        fleet.send(payload)  # type: ignore[arg-type]
    world.step()
    assert len(fleet.messages().receiver) == 0


def test_robots_without_radios_are_refused() -> None:
    fleet = st.World.from_text("position()").fleet()
    with pytest.raises(st.GoneError, match="no robot has a radio number 0"):
        fleet.send(b"x")


def test_batches_of_worlds_read_their_radios() -> None:
    """Worlds with radios are not closed, but have the same arrays."""
    batch = st.Batch.of(swarm()[0], 2, seeds=[1, 2])
    assert batch.sensor("radio", most=3).count.tolist() == [[0, 0, 0]] * 2
    batch.step()
    assert all("is a radio with subscribers" in str(reason) for reason in batch.explain())
