#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Other projects' readers can read logs: the Python packages mcap, mcap-ros2-support and rosbags from build/venv
(tools/setup --python). Without these packages the tests are skipped."""

from __future__ import annotations

import io
import os
import random
import re
import struct
import subprocess
import sys
import tempfile
import unittest
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from build_tree import needs_shared_library  # noqa: E402

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
BINARY_DIR = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release")
STAGE = BINARY_DIR / "bin" / "stage"
VERSION = f"python{sys.version_info.major}.{sys.version_info.minor}"
# Last in the search path, so that the system's NumPy is used.
sys.path.append(str(ROOT / "build" / "venv" / "lib" / VERSION / "site-packages"))

try:
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader, SeekingReader
    from mcap_ros2.decoder import DecoderFactory
except ImportError as missing:
    WITHOUT = f"skipped: {missing}; try tools/setup --python"
else:
    WITHOUT = ""

WORLDS = sorted((ROOT / "worlds").glob("*.world")) + sorted((ROOT / "tests/data/controllers").glob("*.world"))
SECONDS = 2


def stage(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([STAGE, *map(str, arguments)], capture_output=True, text=True, check=False)


def state_hash(done: subprocess.CompletedProcess[str]) -> str:
    found = re.search(r"^state-hash (\w+)$", done.stdout, re.MULTILINE)
    return found[1] if found else done.stderr


def readable(data: bytes) -> list[tuple[str, int, bytes]]:
    """Returns the messages that a sequential reader gets before the end of the log or an error."""
    found = []
    try:
        for _, channel, message in NonSeekingReader(io.BytesIO(data), validate_crcs=True).iter_messages(
                log_time_order=False):
            found.append((channel.topic, message.log_time, message.data))
    except (McapError, struct.error, EOFError):
        pass
    return found


def chunk_ends(data: bytes) -> list[int]:
    """Offsets of the ends of the chunk records."""
    at, ends = 8, []
    while at + 9 <= len(data) - 8:
        op, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        at += 9 + length
        if op == 6:
            ends.append(at)
    return ends


class LogReadersTest(unittest.TestCase):
    def setUp(self) -> None:
        if WITHOUT:
            self.skipTest(WITHOUT)
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.log = Path(self.folder.name) / "run.mcap"

    def record(self, world: Path, *options: object) -> str:
        done = stage("-g", "--duration", SECONDS, "--state-hash", "--log", self.log, *options, world)
        self.assertEqual(done.returncode, 0, done.stderr)
        return state_hash(done)

    def test_every_shipped_world(self) -> None:
        for world in WORLDS:
            with self.subTest(world=world.name):
                plain = stage("-g", "--duration", SECONDS, "--state-hash", world)
                self.assertEqual(self.record(world), state_hash(plain))
                self.check_summary()

    def check_summary(self) -> None:
        """The summary lists the content correctly, and all messages can be decoded."""
        with self.log.open("rb") as file:
            reader = SeekingReader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            self.assertEqual(reader.get_header().profile, "ros2")
            summary = reader.get_summary()
            counts: Counter[int] = Counter()
            clocks = []
            for schema, channel, message, decoded in reader.iter_decoded_messages():
                counts[channel.id] += 1
                self.check_message(schema.name, decoded, message.log_time)
                if channel.topic == "/clock":
                    clocks.append(decoded.clock.sec * 10**9 + decoded.clock.nanosec)
            self.assertEqual(counts, Counter(summary.statistics.channel_message_counts))
            self.assertEqual(sum(counts.values()), summary.statistics.message_count)
            self.assertEqual(clocks, sorted(set(clocks)))
            self.assertEqual((clocks[0], clocks[-1]), (0, SECONDS * 10**9))
            names = [attachment.name for attachment in reader.iter_attachments()]
            self.assertIn(next(iter(reader.iter_metadata())).metadata["world"], names)

    def check_message(self, kind: str, decoded: object, log_time: int) -> None:
        if kind == "sensor_msgs/msg/LaserScan":
            self.assertEqual(decoded.header.stamp.sec * 10**9 + decoded.header.stamp.nanosec, log_time)
            self.assertEqual(len(decoded.ranges), len(decoded.intensities))
            self.assertGreater(decoded.range_max, decoded.range_min)
        elif kind == "nav_msgs/msg/OccupancyGrid":
            self.assertEqual(len(decoded.data), decoded.info.width * decoded.info.height)
            self.assertEqual(set(decoded.data), {0, 100})
        elif kind == "tf2_msgs/msg/TFMessage":
            for transform in decoded.transforms:
                rotation = transform.transform.rotation
                self.assertAlmostEqual(rotation.z**2 + rotation.w**2, 1)

    def decoded(self) -> dict[str, list[object]]:
        """All messages by topic."""
        found: dict[str, list[object]] = {}
        with self.log.open("rb") as file:
            for _, channel, _, message in SeekingReader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
                found.setdefault(channel.topic, []).append(message)
        return found

    @needs_shared_library
    def test_readings_of_all_types_of_sensors(self) -> None:
        """A ring of sonars, which a plug-in defines, is in a log like Stage's own sensors."""
        world = Path(self.folder.name) / "all.world"
        sensors = ("fiducial( alwayson 1 ) blobfinder( range 8 image [20 15] alwayson 1 ) camera( resolution [8 6] "
                   "alwayson 1 ) bumper( bcount 2 alwayson 1 ) sonar_ring( count 5 alwayson 1 )")
        world.write_text('interval_sim 100\nplugins "sonar_ring"\nresolution 0.02\n'
                         'model( pose [3 0 0 0] size [0.1 8 1] color "red" fiducial_return 7 )\n'
                         f'position( name "r" size [0.4 0.4 0.4] {sensors} sonar_ring( count 4 alwayson 1 ) )\n',
                         encoding="utf-8")
        self.record(world)
        found = self.decoded()
        for topic in ("fiducial", "blobfinder", "camera", "bumper", "sonar_ring0", "sonar_ring1"):
            messages = found[f"/readings/{topic}"]
            self.assertEqual([round(m.header.stamp.sec * 10 + m.header.stamp.nanosec / 1e8) for m in messages],
                             list(range(1, 10 * SECONDS + 1)))
            self.assertEqual({m.header.frame_id for m in messages}, {"base_link"})
        self.assertEqual(len(found["/readings/sonar_ring0"][-1].ranges), 5)
        self.assertAlmostEqual(found["/readings/sonar_ring1"][-1].ranges[0], 2.95, delta=0.04)
        fiducial, blobs, camera = (found[f"/readings/{name}"][-1] for name in ("fiducial", "blobfinder", "camera"))
        self.assertEqual((fiducial.count, list(fiducial.id)), (1, [7]))
        self.assertAlmostEqual(fiducial.range[0], 3, delta=0.01)
        self.assertEqual((list(blobs.color), list(blobs.color_shape)), ([1, 0, 0, 1], [1, 4]))
        self.assertEqual((list(camera.color_shape), len(camera.color)), ([6, 8, 3], 144))
        self.assertEqual((list(camera.depth_shape), len(camera.depth)), ([6, 8], 48))
        self.assertEqual(list(found["/readings/bumper"][-1].hit), [False, False])

    def test_rosbags(self) -> None:
        try:
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore
        except ImportError as missing:
            self.skipTest(f"skipped: {missing}; try tools/setup --python")
        self.record(ROOT / "worlds/simple.world")
        store = get_typestore(Stores.ROS2_HUMBLE)
        with AnyReader([self.log], default_typestore=store) as reader:
            types = {connection.topic: connection.msgtype for connection in reader.connections}
            self.assertEqual(types["/r0/base_scan1"], "sensor_msgs/msg/LaserScan")
            for connection, time, data in reader.messages():
                message = reader.deserialize(data, connection.msgtype)
                if connection.msgtype == "sensor_msgs/msg/LaserScan":
                    self.assertEqual(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec, time)
                    self.assertEqual(len(message.ranges), 180 if connection.topic.endswith("scan1") else 1)

    def test_equal_runs_have_equal_logs(self) -> None:
        world = ROOT / "worlds/cave.world"
        self.record(world, "--threads", 1)
        first = self.log.read_bytes()
        for options in (["--threads", 2], ["--threads", 3, "--no-batch"], ["--opencl"], ["--opencl-always"]):
            self.record(world, *options)
            self.assertTrue(self.log.read_bytes() == first, options)

    def test_cut_off_anywhere_it_is_good_to_the_last_whole_chunk(self) -> None:
        for compression in ("none", "lz4", "zstd"):
            done = stage("-g", "--duration", 40, "--log", self.log, "--log-compression", compression,
                         ROOT / "worlds/simple.world")
            if "was built without" in done.stderr:
                continue
            data = self.log.read_bytes()
            whole, ends = readable(data), chunk_ends(data)
            self.assertGreater(len(ends), 2)
            counts = [len(readable(data[:end])) for end in ends]
            self.assertEqual(counts[-1], len(whole))
            chance = random.Random(5)
            cuts = [chance.randrange(len(data)) for _ in range(20)] + [end + d for end in ends for d in (-1, 0, 1)]
            for cut in cuts:
                expected = max([count for end, count in zip(ends, counts) if end <= cut], default=0)
                self.assertEqual(readable(data[:cut]), whole[:expected], (compression, cut))

    def test_a_killed_run_can_be_replayed(self) -> None:
        done = subprocess.Popen([STAGE, "-g", "--log", self.log, ROOT / "worlds/cave.world"],
                                stdout=subprocess.DEVNULL)
        while not self.log.exists() or self.log.stat().st_size < 4_000_000:
            self.assertIsNone(done.poll())
        done.kill()
        done.wait()
        self.assertGreater(len(readable(self.log.read_bytes())), 100)
        shown = stage("replay", "-g", "--state-hash", self.log)
        self.assertEqual(shown.returncode, 0, shown.stderr)
        self.assertIn("ends early", shown.stderr)


if __name__ == "__main__":
    unittest.main()
