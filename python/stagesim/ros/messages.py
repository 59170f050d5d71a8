# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages in which only some numbers change.

A message is serialised once. Afterwards only the numbers are written into its bytes, without converting,
checking or copying each field. This makes publishing for a hundred robots cheap.
"""

from __future__ import annotations

import struct
from typing import Any, Callable, Sequence

import numpy as np
import numpy.typing as npt
from rclpy.serialization import serialize_message

Array = npt.NDArray[Any]

# Improbable numbers that mark a field, so that its offset in the serialised bytes can be found.
MARK = -8.123456789e77
FLOAT_MARK = -8.7654e30


class Template:
    """The bytes of a message, with views of the numbers that change.

    Args:
        message: the message with marks in the fields that change.
        stamped: True: it begins with a std_msgs/Header.
    """

    def __init__(self, message: Any, stamped: bool = True) -> None:
        self._bytes = bytearray(serialize_message(message))
        # The first 4 bytes are the encapsulation header of CDR; the stamp follows.
        self._stamp = self.at(4, np.uint32, 2) if stamped else None

    def at(self, offset: int, dtype: npt.DTypeLike, count: int) -> Array:
        """A writable view of `count` numbers from byte `offset` on."""
        return np.frombuffer(self._bytes, dtype, count, offset)

    def find(self, mark: bytes) -> int:
        """The offset of `mark`, which must occur exactly once."""
        offset = self._bytes.find(mark)
        if offset < 0 or self._bytes.find(mark, offset + 1) >= 0:
            raise RuntimeError("found a message that is serialised in another way than expected")
        return offset

    def doubles(self, mark: float, count: int) -> Array:
        """A view of `count` float64, the first of which was marked with `mark`."""
        return self.at(self.find(struct.pack("=d", mark)), np.float64, count)

    def floats(self, mark: float, count: int) -> Array:
        """A view of `count` successive float32, all of which were marked with `mark`."""
        return self.at(self.find(struct.pack("=f", mark) * count) if count else 0, np.float32, count)

    def tail(self, dtype: npt.DTypeLike, count: int) -> Array:
        """A view of the last `count` numbers."""
        return self.at(len(self._bytes) - count * np.dtype(dtype).itemsize, dtype, count)

    def indices(self, offsets: Sequence[int], width: int) -> Array:
        """Indices for write() of the `width` bytes from each offset on: shape (n, width)."""
        return np.asarray(offsets)[:, None] + np.arange(width)

    def write(self, indices: Array, numbers: Array) -> None:
        """Writes a row of numbers to the bytes of each row of indices."""
        np.frombuffer(self._bytes, np.uint8)[indices] = np.ascontiguousarray(numbers).view(np.uint8)

    def stamp(self, now: Array) -> None:
        """Sets the header's stamp: seconds and nanoseconds."""
        if self._stamp is not None:
            self._stamp[:] = now

    def bytes(self) -> bytes:
        """The serialised message, for publish()."""
        return bytes(self._bytes)


def stamp_of(microseconds: int) -> Array:
    """Converts a time to seconds and nanoseconds: uint32, shape (2,)."""
    return np.array([microseconds // 1_000_000, microseconds % 1_000_000 * 1000], np.uint32)


def stamps_of(microseconds: Array) -> Array:
    """Converts times of shape (n,) to seconds and nanoseconds: uint32, shape (n, 2)."""
    return np.stack([microseconds // 1_000_000, microseconds % 1_000_000 * 1000], -1).astype(np.uint32)


def planar(poses: Array) -> Array:
    """Converts x, y and heading, shape (n, 3), to position and quaternion (x, y, z, w), shape (n, 7)."""
    rows = np.zeros((len(poses), 7))
    rows[:, :2] = poses[:, :2]
    rows[:, 5] = np.sin(poses[:, 2] / 2)
    rows[:, 6] = np.cos(poses[:, 2] / 2)
    return rows


def frames_between(outer: Array, inner: Array) -> Array:
    """The frames (x, y, heading in the world; shape (n, 3)) in which the world poses `outer` have the poses `inner`."""
    frames = np.empty_like(outer)
    # Normalize to -pi to pi; exactly 0 if the headings are equal.
    frames[:, 2] = np.remainder(outer[:, 2] - inner[:, 2] + np.pi, 2 * np.pi) - np.pi
    frames[outer[:, 2] == inner[:, 2], 2] = 0.0
    c, s = np.cos(frames[:, 2]), np.sin(frames[:, 2])
    frames[:, 0] = outer[:, 0] - c * inner[:, 0] + s * inner[:, 1]
    frames[:, 1] = outer[:, 1] - s * inner[:, 0] - c * inner[:, 1]
    return frames


def in_frames(frames: Array, poses: Array) -> Array:
    """Transforms poses from their frames to that of the frames: x, y and heading, shape (n, 3) each."""
    placed = frames + poses
    c, s = np.cos(frames[:, 2]), np.sin(frames[:, 2])
    placed[:, 0] = frames[:, 0] + c * poses[:, 0] - s * poses[:, 1]
    placed[:, 1] = frames[:, 1] + s * poses[:, 0] + c * poses[:, 1]
    return placed


def heading_of(orientation: Any) -> float:
    """The rotation about z of a Quaternion, radians; 0 if all components are 0."""
    q = orientation
    return float(np.arctan2(2 * (q.w * q.z + q.x * q.y), q.w**2 + q.x**2 - q.y**2 - q.z**2))


class Transforms:
    """A TFMessage of several transforms, whose stamps and poses change.

    Args:
        make: the classes TFMessage and TransformStamped.
        frames: parent and child frame of each transform.
    """

    def __init__(self, make: tuple[Callable[[], Any], Callable[[], Any]],
                 frames: Sequence[tuple[str, str]]) -> None:
        message = make[0]()
        for i, (parent, child) in enumerate(frames):
            transform = make[1]()
            transform.header.stamp.sec = 0x5AFE_0000 + i
            transform.header.stamp.nanosec = 0x5EED_0000 + i
            transform.header.frame_id = parent
            transform.child_frame_id = child
            transform.transform.translation.x = MARK - i * 1e70
            message.transforms.append(transform)
        self._template = Template(message, stamped=False)
        find, number = self._template.find, range(len(frames))
        self._stamps = self._template.indices(
            [find(struct.pack("=iI", 0x5AFE_0000 + i, 0x5EED_0000 + i)) for i in number], 8)
        self._poses = self._template.indices(
            [find(struct.pack("=d", MARK - i * 1e70)) for i in number], 56)

    def bytes(self, stamps: Array, poses: Array) -> bytes:
        """Serialises the message.

        Args:
            stamps: seconds and nanoseconds: shape (n, 2), or (2,) for all.
            poses: position and quaternion of each transform: shape (n, 7).
        """
        self._template.write(self._stamps, np.broadcast_to(stamps, (len(poses), 2)))
        self._template.write(self._poses, poses)
        return self._template.bytes()
