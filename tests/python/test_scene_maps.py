# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps of ROS's map_server: map.yaml and its picture."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim.scenes import GridMap, Robot

YAML = "image: map.pgm\nresolution: 0.1\norigin: [-1.5, 2, 0.25]\noccupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n"
GREYS = [0, 10, 88, 89, 90, 128, 204, 205, 206, 254, 255]


def pgm(rows: np.ndarray) -> bytes:
    return b"P5\n# made by a test\n%d %d\n255\n" % (rows.shape[1], rows.shape[0]) + rows.astype(np.uint8).tobytes()


def png(samples: np.ndarray) -> bytes:
    """A PNG file of samples in the shape (rows, columns, channels)."""
    rows, columns, channels = samples.shape
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    lines = np.concatenate([np.zeros((rows, 1), np.uint8), samples.reshape(rows, -1).astype(np.uint8)], axis=1)

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, kind, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(lines.tobytes())) + chunk(b"IEND", b""))


def write(folder: Path, picture: bytes, yaml: str = YAML, name: str = "map.pgm") -> Path:
    (folder / name).write_bytes(picture)
    (folder / "map.yaml").write_text(yaml)
    return folder / "map.yaml"


def expected(pixel: tuple[int, ...], mode: str, occupied: float, free: float, negate: bool) -> int:
    """The value of a cell by the rules in map_server's documentation."""
    colours = pixel if mode == "trinary" or len(pixel) in (1, 3) else pixel[:-1]
    grey = sum(colours) / len(colours)
    if mode == "raw":
        return round(grey) if round(grey) <= 100 else -1
    share = grey / 255 if negate else (255 - grey) / 255
    if share > occupied:
        return 100
    if share < free:
        return 0
    is_clear = len(pixel) in (2, 4) and pixel[-1] < 255
    return -1 if mode == "trinary" or is_clear else min(99, max(1, round(1 + 98 * (share - free) / (occupied - free))))


@pytest.mark.parametrize("negate", [False, True])
@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("thresholds", [(0.65, 0.196), (0.5, 0.1), (0.9, 0.25)])
@pytest.mark.parametrize("channels", [0, 1, 2, 3, 4])  # 0: a PGM file
def test_rules_of_map_server(tmp_path: Path, channels: int, thresholds: tuple[float, float], mode: str,
                             negate: bool) -> None:
    samples = np.random.default_rng(channels).choice(GREYS, (6, 9, channels or 1))
    occupied, free = thresholds
    yaml = (f'image: "map.pic"  # a comment\nmode: {mode}\nresolution: 0.05\norigin:\n- 1\n- -2.5\n- 0\n'
            f"negate: {int(negate)}\noccupied_thresh: {occupied}\nfree_thresh: {free}\n")
    file = write(tmp_path, png(samples) if channels else pgm(samples[:, :, 0]), yaml, "map.pic")
    walls = GridMap.from_file(file)
    wanted = [[expected(tuple(map(int, pixel)), mode, occupied, free, negate) for pixel in row] for row in samples]
    assert np.asarray(walls.array)[::-1].tolist() == wanted
    assert walls.resolution == 0.05 and walls.origin == (1, -2.5, 0, 0)
    limit = 100 * occupied if mode == "raw" else 100
    assert (walls.occupied[::-1] == (np.array(wanted) >= limit)).all()


def test_walls_are_where_the_picture_has_them(tmp_path: Path) -> None:
    rows = np.full((20, 30), 254)
    rows[-1, :] = 0  # the lowest row of the world
    rows[5, 20] = 0
    rows[6, 20] = 205
    file = write(tmp_path, pgm(rows), YAML.replace("0.25", "0"))
    world = st.World.from_map(file, [Robot(pose=(0, 3, 0), size=(.2, .2, .2))])
    # Row 5 from the top is row 14 from the bottom: its middle is at y = 2 + 14.5 * 0.1, and column 20 begins at x = 0.5.
    assert world.cast([-1, 3.45, 0], 0, 9, ray_model="exact")[0] == pytest.approx(1.5)
    assert world.cast([-1, 3.35, 0], 0, 9, ray_model="exact")[0] == 9
    assert world.cast([-1, 3.35, 0], -np.pi / 2, 9, ray_model="exact")[0] == pytest.approx(1.25)
    unknown = st.World.from_map(file, unknown="occupied")
    assert unknown.cast([-1, 3.35, 0], 0, 9, ray_model="exact")[0] == pytest.approx(1.5)
    assert world.fleet().names == ("r0",)


def test_defaults(tmp_path: Path) -> None:
    file = write(tmp_path, pgm(np.array([[0, 90, 205, 254]])), "image: map.pgm\nresolution: 1\norigin: [0, 0, 0]\n")
    assert np.asarray(GridMap.from_file(file).array).tolist() == [[100, -1, -1, 0]]


MISTAKES = [
    (YAML.replace("resolution: 0.1\n", ""), "found no resolution, expected one"),
    (YAML.replace("image: map.pgm\n", ""), "found no image, expected one"),
    (YAML.replace("origin", "orgin"), "found no origin, expected one"),
    (YAML.replace("0.1\n", "tenth\n"), "resolution: found 'tenth', expected a number"),
    (YAML.replace("0.1\n", ".nan\n"), "resolution: found '.nan', expected a number"),
    (YAML.replace("0.1\n", "-1\n"), "resolution: found -1.0, expected metres above 0"),
    (YAML.replace("[-1.5, 2, 0.25]", "[0, 0]"),
     "origin: found ['0', '0'], expected [x, y, heading] in metres and radians"),
    (YAML.replace("[-1.5, 2, 0.25]", "5"), "origin: found '5', expected [x, y, heading] in metres and radians"),
    (YAML.replace("0.196", "0.7"),
     "found free_thresh 0.7 and occupied_thresh 0.65, expected 0 <= free_thresh < occupied_thresh <= 1"),
    (YAML + "mode: fancy\n", "mode: found 'fancy', expected trinary, scale, raw"),
    (YAML.replace("map.pgm", "absent.pgm"), "image: {folder}/absent.pgm: cannot open the picture: No such file or directory"),
    (YAML.replace("map.pgm", "map.bmp"), "image: {folder}/map.bmp: found a picture of another kind, expected PGM or PNG"),
    (YAML.replace("map.pgm", "map.txt"), "image: {folder}/map.txt: this is not a picture of a known kind"),
    ("just text\n", None),
]


@pytest.mark.parametrize(("yaml", "message"), MISTAKES)
def test_mistakes_are_told(tmp_path: Path, yaml: str, message: str | None) -> None:
    (tmp_path / "map.txt").write_text("this is text")
    row = bytes([0, 0, 0, 0])
    (tmp_path / "map.bmp").write_bytes(b"BM" + struct.pack("<IHHIIiiHHIIiiII", 58, 0, 0, 54, 40, 1, 1, 1, 24, 0, 4, 0, 0, 0,
                                                           0) + row)
    file = write(tmp_path, pgm(np.zeros((2, 2))), yaml)
    with pytest.raises(ValueError) as caught:
        st.World.from_map(file)
    told: Any = str(caught.value)
    if message is None:
        assert told == f"{file}:1: found 'just text', expected NAME: VALUE"
    else:
        assert told.startswith(f"{file}: {message.format(folder=tmp_path)}") and "\n" not in told


def test_an_absent_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        st.World.from_map(tmp_path / "map.yaml")
