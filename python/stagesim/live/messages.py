# SPDX-License-Identifier: GPL-2.0-or-later
"""The messages between the server and the page.

A message to the page is binary: the length of the header (a word), the header (JSON, padded with blanks to whole
words), and little-endian 32-bit words whose meaning the header defines. A message from the page is JSON: see
`order_of`.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Hashable
from typing import Any

import numpy as np

from .fields import flag, found, integer, items, number, seed, triple
from .floor import FieldPicture
from .scene import Frame, Scene, State, Wish
from .show import Show

#: Max size of a message from the page, bytes.
MAX_ORDER_BYTES = 16_384
MAX_SCANS = 256
GLOW_BYTES = 16  #: x, y and radius, then a colour: see scene.hh

Order = Callable[[Show], Any]


def packed(header: dict[str, Any], *words: bytes) -> bytes:
    """Makes a message to the page."""
    text = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join((struct.pack("<I", len(text)), text, *words))


def unpacked(message: bytes) -> tuple[dict[str, Any], bytes]:
    """Splits a message to the page into its header and its words."""
    (length,) = struct.unpack_from("<I", message)
    return json.loads(message[4:4 + length]), message[4 + length:]


def scene_message(scene: Scene, known: int, world: str, dt: float) -> bytes:
    """Makes the message with a scene: its things, and the shapes from number `known` on, as words (see scene.hh).

    In the header, `first` is the number of the first of these shapes, and `lengths` are their lengths in words.
    """
    things = [{"id": t.id, "name": name, "type": t.type, "robot": t.robot, "movable": t.movable, "shape": shape}
              for t, name, shape in zip(scene.things, scene.names, scene.shape_of)]
    shapes = scene.shapes.after(known)
    return packed({"type": "scene", "scene": scene.number, "world": world, "dt": dt, "things": things,
                   "first": known, "lengths": [len(shape) // 4 for shape in shapes]}, *shapes)


def places_words(frame: Frame) -> bytes:
    """Packs x, y and heading of each thing (float32), then a bit per thing that is set if it is stalled, LSB first."""
    bits = np.packbits(frame.stalled, bitorder="little").tobytes()
    return frame.places.astype("<f4").tobytes() + bits + b"\0" * (-len(bits) % 4)


def field_message(picture: FieldPicture) -> bytes:
    """Makes the message with a field: its shades, padded to whole words."""
    rows, columns = picture.shape
    header = {"type": "field", "id": picture.id, "pose": finite(list(picture.pose)), "size": picture.size,
              "patch": picture.patch, "rgb": picture.rgb, "rows": rows, "columns": columns}
    return packed(header, picture.shades, b"\0" * (-len(picture.shades) % 4))


def frame_message(frame: Frame, places: bytes, wish: Wish) -> bytes:
    """Makes the message with a frame: `places` (see places_words()), glows, then the scans that the client wishes.

    In the header, `glows` is the number of glows, and `fields` has the models of all fields that there are.
    """
    wanted = frame.scene.robot_ids if wish.all_scans else []
    scans = [frame.scans[thing] for thing in dict.fromkeys([*wanted, *wish.scans]) if thing in frame.scans]
    details = None if wish.chosen is None else frame.details.get(wish.chosen)
    header = {"type": "frame", "scene": frame.scene.number, "things": len(frame.places),
              **state_of(frame.state), "r_acc": frame.r_acc, "fields": list(frame.fields),
              "glows": len(frame.glows) // GLOW_BYTES, "details": finite(details)}
    return packed(header, places, frame.glows, *scans)


def state_of(state: State) -> dict[str, Any]:
    """The state for the page; the seed is a string, because JavaScript's numbers have 53 bits."""
    return {**vars(state), "seed": str(state.seed)}


def finite(value: Any) -> Any:
    """Replaces NaN and infinities, which JSON can't represent, by None."""
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if isinstance(value, list):
        return [finite(part) for part in value]
    if isinstance(value, dict):
        return {name: finite(part) for name, part in value.items()}
    return value


def error_message(text: str) -> bytes:
    """Makes the message about an invalid order."""
    return packed({"type": "error", "text": text[:500]})


# ---- orders ----

def order_of(message: str | bytes, owner: Hashable) -> Order:
    """Parses an order {"do": NAME, ...} of the page. Raises ValueError if it is invalid.

    The names with their fields are: "pause", "on": true; "speed", "factor"; "step", "count"; "reset", "seed":
    digits or null; "move", "thing", "pose": [x, y, heading]; "drive", "thing", "velocity": [forwards, left,
    turning]; "sense", "thing"; "watch", "chosen": thing or null, "scans": [things], "all": true.
    """
    if isinstance(message, bytes):
        raise ValueError("found bytes, expected text")
    try:
        order = json.loads(message)
    except (ValueError, RecursionError):
        raise ValueError("found something that is not JSON") from None
    if not isinstance(order, dict):
        raise ValueError("found no object, expected one with \"do\"")
    name = order.get("do")
    make = _ORDERS.get(name) if isinstance(name, str) else None
    if make is None:
        raise ValueError(f"do: found {found(name)}, expected one of " + ", ".join(_ORDERS))
    return make(order, owner)


def _pause(order: dict[str, Any], owner: Hashable) -> Order:
    on = flag(order, "on")
    return lambda run: run.pause(on)


def _speed(order: dict[str, Any], owner: Hashable) -> Order:
    factor = number(order, "factor")
    return lambda run: run.set_speed(factor)


def _step(order: dict[str, Any], owner: Hashable) -> Order:
    count = integer(order, "count")
    return lambda run: run.make_steps(count)


def _reset(order: dict[str, Any], owner: Hashable) -> Order:
    chosen = seed(order)
    return lambda run: run.reset(chosen)


def _move(order: dict[str, Any], owner: Hashable) -> Order:
    thing, pose = integer(order, "thing"), triple(order, "pose")
    return lambda run: run.move(thing, pose)


def _drive(order: dict[str, Any], owner: Hashable) -> Order:
    thing, velocity = integer(order, "thing"), triple(order, "velocity")
    return lambda run: run.drive(owner, thing, velocity)


def _sense(order: dict[str, Any], owner: Hashable) -> Order:
    thing = integer(order, "thing")
    return lambda run: run.sense(thing)


def _watch(order: dict[str, Any], owner: Hashable) -> Order:
    scans = tuple(integer({"scans": thing}, "scans") for thing in items(order, "scans"))
    if len(scans) > MAX_SCANS:
        raise ValueError(f"found {len(scans)} things, expected {MAX_SCANS} at most")
    chosen = None if order.get("chosen") is None else integer(order, "chosen")
    wish = Wish(chosen, scans, flag(order, "all"))
    return lambda run: run.wish(owner, wish)


_ORDERS: dict[str, Callable[[dict[str, Any], Hashable], Order]] = {
    "pause": _pause, "speed": _speed, "step": _step, "reset": _reset, "move": _move, "drive": _drive,
    "sense": _sense, "watch": _watch,
}
