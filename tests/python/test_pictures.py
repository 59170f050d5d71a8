# SPDX-License-Identifier: GPL-2.0-or-later
"""World.render(), PNG files and films.

Pictures must be bit-equal to those in tests/python/pictures. After an intended change,
STAGE_NEW_PICTURES=1 rewrites them: look at each before you commit it.
"""

from __future__ import annotations

import os
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
import stagesim as st


def decoded(data: bytes) -> np.ndarray:
    """Decodes a PNG file of the package, whose rows have no filter."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, parts = 8, {}
    while at < len(data):
        length = struct.unpack(">I", data[at:at + 4])[0]
        name, body = data[at + 4:at + 8], data[at + 8:at + 8 + length]
        assert zlib.crc32(name + body) == struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0]
        parts[name] = body
        at += 12 + length
    width, height, *rest = struct.unpack(">IIBBBBB", parts[b"IHDR"])
    assert rest == [8, 2, 0, 0, 0]
    rows = np.frombuffer(zlib.decompress(parts[b"IDAT"]), np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 0).all()
    return rows[:, 1:].reshape(height, width, 3)


def count(pixels: np.ndarray, color: tuple[int, int, int]) -> int:
    return int((pixels == color).all(axis=2).sum())


def check_golden(pixels: np.ndarray, golden: Path) -> None:
    if os.environ.get("STAGE_NEW_PICTURES"):
        st.save_png(golden, pixels)
    expected = decoded(golden.read_bytes())
    assert pixels.shape == expected.shape
    assert (pixels == expected).all(), f"{(pixels != expected).any(axis=2).sum()} pixels differ"


@pytest.mark.parametrize(("file", "size"), [("arena", (200, 200)), ("zoo", (320, 256)), ("cave", (240, 240)),
                                            ("hospital", (400, 164))])
def test_pictures_equal_the_stored_ones(file: str, size: tuple[int, int], root: Path) -> None:
    world = st.World(f"{file}.world", seed=5)
    world.fleet().ranger(0)
    world.step(20)
    pixels = world.render(*size)
    assert pixels.shape == (size[1], size[0], 3) and pixels.dtype == np.uint8
    check_golden(pixels, root / "tests" / "python" / "pictures" / f"{file}.png")


def test_picture_of_the_page(root: Path) -> None:
    """The picture in docs/python.md is up to date."""
    golden = root / "docs" / "pictures" / "python.png"
    if not golden.parent.exists():
        pytest.skip("there is no docs")
    world = st.World("cave.world", seed=5)
    scan = world.fleet().ranger(1)
    world.step(20)
    check_golden(world.render(720, 360, center=(-14, 14), scale=24), golden)
    assert scan.ranges.shape == (100, 180)


ONE = """
resolution 0.02
model( pose [0 0 -5 0] size [8 8 1] color_rgba [1 1 1 1] )
position( name "r" pose [2 1 0 90] size [1 0.6 0.5] color_rgba [0 0 1 1] )
model( name "box" pose [-2 -1 0 0] size [1 1 1] color_rgba [0 1 0 1] )
"""


def test_places_and_scale() -> None:
    """At 20 pixels per metre, models are at the right pixels, and y points up."""
    world = st.World.from_text(ONE)
    pixels = world.render(160, 160, center=(0, 0), scale=20)
    blue, green = (pixels == (0, 0, 255)).all(axis=2), (pixels == (0, 255, 0)).all(axis=2)
    for found, x, y, width, height in ((blue, 120, 60, 12, 20), (green, 40, 100, 20, 20)):
        rows, columns = np.nonzero(found)
        assert columns.min() + columns.max() == pytest.approx(2 * x, abs=2)
        assert rows.min() + rows.max() == pytest.approx(2 * y, abs=2)
        # The width is measured without edges.
        assert np.ptp(columns) + 1 == pytest.approx(width - 2, abs=1)
        assert np.ptp(rows) + 1 == pytest.approx(height - 2, abs=1)
    # The nose is a pale triangle that points north.
    rows, columns = np.nonzero((pixels == (217, 217, 255)).all(axis=2))
    assert rows.min() == pytest.approx(51, abs=2) and rows.max() == pytest.approx(62, abs=1)
    assert np.mean(columns) == pytest.approx(119.5, abs=1)
    assert np.ptp(columns[rows == rows.max()]) > np.ptp(columns[rows == rows.min()])


@pytest.mark.parametrize(("robots", "width"), [(4, 5), (1001, 3)])
def test_small_robots_are_dots(robots: int, width: int) -> None:
    """Dots make small robots visible at any scale, as in the window and on the page."""
    crowd = "".join(f"position( pose [{20 * i} 0 0 0] size [0.4 0.4 0.3] color_rgba [1 0 0 1] )\n"
                    for i in range(robots))
    pixels = st.World.from_text("resolution 0.1\n" + crowd).render(100, 50, center=(0, 0), scale=1)
    # The robots at 0, 20 and 40 m are visible; the view has 50 pixels to the right of the center.
    assert (pixels == (255, 0, 0)).all(axis=2).sum() == 3 * width * width


def test_gui_nose_0_hides_the_nose() -> None:
    world = st.World.from_text(ONE.replace("size [1 0.6 0.5]", "size [1 0.6 0.5] gui_nose 0"))
    pixels = world.render(160, 160, center=(0, 0), scale=20)
    assert not (pixels == (217, 217, 255)).all(axis=2).any()


def test_picture_fits_the_contents_of_the_world() -> None:
    world = st.World.from_text(ONE)
    pixels = world.render(300, 200)
    white = (pixels == 255).all(axis=2)
    rows, columns = np.nonzero(white)
    assert np.ptp(rows) + 1 == pytest.approx(200 / 1.04, abs=4)
    assert columns.min() + columns.max() == pytest.approx(300, abs=2)
    assert st.World.from_text("resolution 0.02").render(5, 4).shape == (4, 5, 3)


def test_higher_bodies_hide_lower_ones() -> None:
    boxes = """resolution 0.02
model( size [1 1 %s] color_rgba [1 0 0 1] )
model( size [2 2 1] color_rgba [0 1 0 1] )"""
    low = st.World.from_text(boxes % 0.5).render(50, 50)
    high = st.World.from_text(boxes % 1.5).render(50, 50)
    assert count(low, (255, 0, 0)) == 0 and count(high, (255, 0, 0)) > 300


def test_holes_and_translucence() -> None:
    ring = """resolution 0.02
model( size [3 3 1] color_rgba [0 0 1 %s]
  block( points 4 point[0] [0 0] point[1] [3 0] point[2] [3 3] point[3] [0 3] z [0 1] )
  block( points 4 point[0] [1 1] point[1] [2 1] point[2] [2 2] point[3] [1 2] z [0 1] ) )"""
    pixels = st.World.from_text(ring % 1).render(60, 60, center=(0, 0), scale=10)
    assert (pixels[30, 30] == pixels[0, 0]).all() and (pixels[30, 18] == (0, 0, 255)).all()
    clear = st.World.from_text(ring % 0.5).render(60, 60, center=(0, 0), scale=10)
    assert (clear[30, 18] > 60).all() and clear[30, 18, 2] > 250
    assert (st.World.from_text(ring % 0).render(60, 60) == pixels[0, 0]).all()


def test_scans(room: str) -> None:
    world = st.World.from_text(room)
    bare = world.render(120, 120)
    scan = world.fleet().ranger(0)
    world.step(3)
    assert (world.render(120, 120, data=False) == bare).all()
    drawn = (world.render(120, 120) != bare).any(axis=2)
    assert 0.1 < drawn.mean() < 0.9
    assert np.isfinite(scan.ranges).all()
    # Scans do not tint robots.
    colour = tuple(int(c) for c in bare[tuple(np.argwhere((bare == (255, 0, 0)).all(axis=2))[0])])
    assert count(world.render(120, 120), colour) == count(bare, colour)


def test_stalled_robots_have_red_edges(room: str) -> None:
    world = st.World.from_text(room)
    fleet = world.fleet("a")
    world.model("a").color = (0, 0, 1, 1)
    before = count(world.render(center=(0, 0), scale=40), (255, 0, 0))
    fleet.cmd[:] = (1, 0, 0)
    world.step(40)
    assert fleet.stalled[0]
    x, y, _ = fleet.pose[0]
    assert count(world.render(60, 60, center=(x, y), scale=40), (255, 0, 0)) > 40 > before / 100


def test_extreme_coordinates_do_not_overflow() -> None:
    """Extreme coordinates do not overflow: they are rasterized or omitted."""
    world = st.World.from_text("""resolution 0.02
model( pose [3 0 0 0] size [0.1 8 1] )
position( localization "gps" ranger( sensor( range [0 "inf"] fov 300 samples 9 ) ) )""")
    world.fleet().ranger(0)
    world.step(2)
    for center in ((0, 0), (1e9, -1e9), (-4, 1e300)):
        for scale in (1e-300, 1e-9, 1, 1e5, 1e300):
            world.render(20, 30, center=center, scale=scale)
    assert (world.render(20, 20, center=(1e9, 0), scale=1) == world.render(1, 1, center=(9e9, 0))[0, 0]).all()


def test_bad_arguments(room: str) -> None:
    world = st.World.from_text(room)
    for wrong in ({"width": 0}, {"height": 20000}, {"scale": 0}, {"scale": np.nan}, {"center": (np.inf, 0)}):
        with pytest.raises(ValueError, match="found"):
            world.render(**wrong)
    for pixels in (np.zeros((3, 3), np.uint8), np.zeros((3, 3, 3)), np.zeros((0, 3, 3), np.uint8)):
        with pytest.raises(ValueError, match="found pixels"):
            st.save_png("never.png", pixels)
    world.close()
    with pytest.raises(st.GoneError):
        world.render()
    assert world._repr_png_() is None


def test_rendering_changes_nothing() -> None:
    world, other = st.World("arena.world"), st.World("arena.world")
    for _ in range(3):
        world.render(50, 50)
        world.step()
        other.step()
    assert world.state_hash() == other.state_hash()


def test_worlds_of_a_batch() -> None:
    world, batch = st.World("arena.world", seed=1), st.Batch("arena.world", 2, seeds=[0, 1])
    world.fleet().ranger(0)
    batch.ranger(0)
    world.step(3)
    batch.step(n=3)
    assert (batch.fork(1).render(90, 90) == world.render(90, 90)).all()


def test_png(tmp_path: Path) -> None:
    world = st.World("arena.world")
    data = world._repr_png_()
    assert data is not None and (decoded(data) == world.render()).all()
    st.save_png(tmp_path / "a.png", world.render(33, 21))
    assert (decoded((tmp_path / "a.png").read_bytes()) == world.render(33, 21)).all()
    image = pytest.importorskip("PIL.Image").open(tmp_path / "a.png")
    assert (np.asarray(image) == world.render(33, 21)).all()


# ---- films ----

def test_gif(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    world = st.World("arena.world")
    fleet = world.fleet()
    fleet.cmd[:] = (0.3, 0, 0.5)
    with st.Film(tmp_path / "a.gif", world, every=0.3, width=80, height=60) as film:
        taken = [film.take() for _ in range(10) if world.step() or True]
        assert film.count == sum(taken) == 4
        expected = world.render(80, 60, center=(0, 0), scale=film._view["scale"])
        world.model("r0").pose = (30, 0, 0)  # the film keeps its view
        world.step(3)
        film.take()
    with pytest.raises(st.StageError, match="finished"):
        film.take()
    found = image.open(tmp_path / "a.gif")
    assert (found.size, found.n_frames) == ((80, 60), 5)
    times = []
    for index in range(found.n_frames):
        found.seek(index)
        times.append(found.info["duration"])
    assert sum(times) == pytest.approx(5 * 300, abs=10)
    found.seek(3)
    # A GIF has only 256 colours.
    assert np.abs(np.asarray(found.convert("RGB")).astype(int) - expected).mean() < 3


def test_films_continue_after_a_reset(tmp_path: Path) -> None:
    pytest.importorskip("PIL.Image")
    world = st.World("arena.world")
    with st.Film(tmp_path / "a.gif", world, every=1, width=20, height=20) as film:
        assert film.take() and not film.take()
        world.step(25)
        assert film.take() and not film.take()
        world.reset()
        assert film.take()


def test_films_that_cannot_be_written_are_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    world = st.World("arena.world")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(st.StageError, match="ffmpeg, which is not on PATH"):
        st.Film(tmp_path / "a.mp4", world)
    monkeypatch.setitem(__import__("sys").modules, "PIL.Image", None)
    with pytest.raises(st.StageError, match=r"stagesim\[pictures\]"):
        st.Film(tmp_path / "a.gif", world)
    monkeypatch.undo()
    for wrong in ({"every": 0}, {"every": -1}, {"fps": 0}, {"fps": np.inf}):
        with pytest.raises(ValueError, match="found"):
            st.Film(tmp_path / "a.gif", world, **wrong)
    pytest.importorskip("PIL.Image")
    with pytest.raises(OSError):
        st.Film(tmp_path / "no" / "a.gif", world)
    with st.Film(tmp_path / "a.gif", world):
        pass
    assert not (tmp_path / "a.gif").exists()


def fake_ffmpeg(folder: Path, script: str) -> None:
    program = folder / "ffmpeg"
    program.write_text("#!/bin/sh\n" + script)
    program.chmod(0o755)


def test_video_goes_through_ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake_ffmpeg(tmp_path, 'for last; do :; done; echo "$@" > "${last#file:}.args"; cat > "${last#file:}"\n')
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    world = st.World("arena.world")
    file = tmp_path / "a b.mp4"
    with st.Film(file, world, fps=25, width=31, height=20) as film:
        for _ in range(3):
            world.step()
            film.take()
    assert file.read_bytes()[-31 * 20 * 3:] == world.render(31, 20).tobytes()
    assert file.stat().st_size == 3 * 31 * 20 * 3
    arguments = Path(f"{file}.args").read_text()
    assert "-s 31x20 -r 25.0" in arguments and "yuv420p" in arguments


def test_errors_of_ffmpeg_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake_ffmpeg(tmp_path, "echo 'no such codec' >&2; exit 1\n")
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    world = st.World("arena.world")
    with pytest.raises(st.StageError, match=r"a\.mp4 can't be written: ffmpeg: no such codec"):
        with st.Film(tmp_path / "a.mp4", world) as film:
            for _ in range(20):
                film.take()


def test_mp4(tmp_path: Path) -> None:
    """Makes a film with the real ffmpeg, if it is installed."""
    if not __import__("shutil").which("ffmpeg"):
        pytest.skip("there is no ffmpeg")
    world = st.World("arena.world")
    with st.Film(tmp_path / "a.mp4", world, width=101, height=77) as film:
        for _ in range(5):
            world.step()
            film.take()
    raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", str(tmp_path / "a.mp4"), "-f", "rawvideo",
                          "-pix_fmt", "rgb24", "-"], capture_output=True, check=True).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(5, 78, 102, 3)
    assert np.abs(frames[-1, :77, :101].astype(int) - world.render(101, 77)).mean() < 10
