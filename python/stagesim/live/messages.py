# SPDX-License-Identifier: GPL-2.0-or-later
"""What goes between the server and the page.

A message to the page is binary: the length of a header (a word), the header (JSON, filled up with blanks to
whole words), and words of 32 bits, the lowest byte first, that the header tells the meaning of. A message
from the page is JSON: see `order_of`.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Hashable
from typing import Any

import numpy as np

from .scene import Frame, Scene, State, Wish
from .show import Show

#: Bytes of a message from the page.
LONGEST_ORDER = 16_384
MOST_SCANS = 256

Order = Callable[[Show], Any]


def packed(header: dict[str, Any], *words: bytes) -> bytes:
    """A message to the page."""
    text = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join((struct.pack("<I", len(text)), text, *words))


def unpacked(message: bytes) -> tuple[dict[str, Any], bytes]:
    """The header and the words of a message to the page."""
    (length,) = struct.unpack_from("<I", message)
    return json.loads(message[4:4 + length]), message[4 + length:]


def scene_message(scene: Scene, known: int, world: str, dt: float) -> bytes:
    """Things, and the shapes beyond those that are known, one after the other.

    `first` is the number of the first of these; `lengths` says how many words each has. See scene.hh.
    """
    things = [{"id": t.id, "name": t.name, "type": t.type, "robot": t.robot, "movable": t.movable,
               "shape": shape} for t, shape in zip(scene.things, scene.shape_of)]
    shapes = scene.shapes.after(known)
    return packed({"type": "scene", "scene": scene.number, "world": world, "dt": dt, "things": things,
                   "first": known, "lengths": [len(shape) // 4 for shape in shapes]}, *shapes)


def places_words(frame: Frame) -> bytes:
    """x, y and heading of each thing, and then whether it is blocked: a bit each, the lowest first."""
    bits = np.packbits(frame.stalled, bitorder="little").tobytes()
    return frame.places.astype("<f4").tobytes() + bits + b"\0" * (-len(bits) % 4)


def frame_message(frame: Frame, places: bytes, wish: Wish) -> bytes:
    """Places, then the scans that are wished for. `places` is what places_words() makes."""
    wanted = frame.scene.robot_ids if wish.all_scans else []
    scans = [frame.scans[thing] for thing in dict.fromkeys([*wanted, *wish.scans]) if thing in frame.scans]
    details = None if wish.chosen is None else frame.details.get(wish.chosen)
    header = {"type": "frame", "scene": frame.scene.number, "things": len(frame.places),
              **state_of(frame.state), "r_acc": frame.r_acc,
              "details": finite(details)}
    return packed(header, places, *scans)


def state_of(state: State) -> dict[str, Any]:
    """As the page wants it; the seed as text, as numbers of JavaScript have 53 bits."""
    return {**vars(state), "seed": str(state.seed)}


def finite(value: Any) -> Any:
    """None instead of numbers that JSON doesn't know."""
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if isinstance(value, list):
        return [finite(part) for part in value]
    if isinstance(value, dict):
        return {name: finite(part) for name, part in value.items()}
    return value


def error_message(text: str) -> bytes:
    """What was wrong with an order."""
    return packed({"type": "error", "text": text[:500]})


# ---- orders ----

def order_of(message: str | bytes, owner: Hashable) -> Order:
    """What the page wants: {"do": NAME, ...}. Raises ValueError if it is nothing of these.

    {"do": "pause", "on": true}; "speed", "factor"; "step", "count"; "reset", "seed": digits or null;
    "move", "thing", "pose": [x, y, heading]; "drive", "thing", "velocity": [forwards, left, turning];
    "sense", "thing"; "watch", "chosen": thing or null, "scans": [things], "all": true.
    """
    if isinstance(message, bytes):
        raise ValueError("found bytes, expected text")
    try:
        order = json.loads(message)
    except (ValueError, RecursionError):
        raise ValueError("found something that is not JSON") from None
    if not isinstance(order, dict):
        raise ValueError("found no object, expected one with \"do\"")
    make = _ORDERS.get(str(order.get("do")))
    if make is None:
        raise ValueError(f"found the order {str(order.get('do'))[:40]!r}, expected one of "
                         + ", ".join(_ORDERS))
    return make(order, owner)


def _number(order: dict[str, Any], name: str) -> float:
    value = order.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or abs(value) > 1e300:
        raise ValueError(f"found {str(value)[:40]}, expected a number in {name!r}")
    return float(value)


def _integer(order: dict[str, Any], name: str) -> int:
    value = _number(order, name)
    if value != int(value) or not 0 <= value < 2**32:
        raise ValueError(f"found {value}, expected a whole number in {name!r}")
    return int(value)


def _flag(order: dict[str, Any], name: str) -> bool:
    value = order.get(name)
    if not isinstance(value, bool):
        raise ValueError(f"found {str(value)[:40]}, expected true or false in {name!r}")
    return value


def _list(order: dict[str, Any], name: str) -> list[Any]:
    value = order.get(name)
    if not isinstance(value, list):
        raise ValueError(f"found {str(value)[:40]}, expected a list in {name!r}")
    return value


def _triple(order: dict[str, Any], name: str) -> tuple[float, float, float]:
    values = _list(order, name)
    if len(values) != 3:
        raise ValueError(f"found {len(values)} numbers, expected three in {name!r}")
    x, y, a = (_number({name: value}, name) for value in values)
    return x, y, a


def _seed(order: dict[str, Any]) -> int | None:
    seed = order.get("seed")
    if seed is None:
        return None
    if not isinstance(seed, (int, str)) or not str(seed).isdecimal() or len(str(seed)) > 20:
        raise ValueError(f"found the seed {str(seed)[:40]!r}, expected digits")
    return int(seed)


def _pause(order: dict[str, Any], owner: Hashable) -> Order:
    on = _flag(order, "on")
    return lambda run: run.pause(on)


def _speed(order: dict[str, Any], owner: Hashable) -> Order:
    factor = _number(order, "factor")
    return lambda run: run.set_speed(factor)


def _step(order: dict[str, Any], owner: Hashable) -> Order:
    count = _integer(order, "count")
    return lambda run: run.make_steps(count)


def _reset(order: dict[str, Any], owner: Hashable) -> Order:
    seed = _seed(order)
    return lambda run: run.reset(seed)


def _move(order: dict[str, Any], owner: Hashable) -> Order:
    thing, pose = _integer(order, "thing"), _triple(order, "pose")
    return lambda run: run.move(thing, pose)


def _drive(order: dict[str, Any], owner: Hashable) -> Order:
    thing, velocity = _integer(order, "thing"), _triple(order, "velocity")
    return lambda run: run.drive(owner, thing, velocity)


def _sense(order: dict[str, Any], owner: Hashable) -> Order:
    thing = _integer(order, "thing")
    return lambda run: run.sense(thing)


def _watch(order: dict[str, Any], owner: Hashable) -> Order:
    scans = tuple(_integer({"scans": thing}, "scans") for thing in _list(order, "scans"))
    if len(scans) > MOST_SCANS:
        raise ValueError(f"found {len(scans)} things, expected {MOST_SCANS} at most")
    chosen = None if order.get("chosen") is None else _integer(order, "chosen")
    wish = Wish(chosen, scans, _flag(order, "all"))
    return lambda run: run.wish(owner, wish)


_ORDERS: dict[str, Callable[[dict[str, Any], Hashable], Order]] = {
    "pause": _pause, "speed": _speed, "step": _step, "reset": _reset, "move": _move, "drive": _drive,
    "sense": _sense, "watch": _watch,
}
