# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes pictures to PNG files, and films to GIF and video files."""

from __future__ import annotations

import os
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import StageError

if TYPE_CHECKING:
    import subprocess

    from .world import World

#: Red, green and blue of each pixel: shape (height, width, 3), the top row first.
Pixels = npt.NDArray[np.uint8]


def png_of(pixels: Pixels) -> bytes:
    """Encodes a picture as PNG. Raises ValueError if the array is no picture."""
    import struct
    import zlib

    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != np.uint8 or pixels.size == 0:
        raise ValueError(f"found pixels of shape {pixels.shape}, {pixels.dtype}; "
                         "expected (height, width, 3), uint8")

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    height, width, _ = pixels.shape
    # In PNG, each row begins with the number of its filter; 0 means no filter.
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, 3 * width)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9))
            + chunk(b"IEND", b""))


def save_png(file: str | os.PathLike[str], pixels: Pixels) -> None:
    """Writes a picture to a PNG file.

    Args:
        file: the file; it is overwritten.
        pixels: red, green and blue as World.render() returns them: uint8, shape (height, width, 3).

    Raises:
        ValueError: `pixels` has another shape or type.
        OSError: the file can't be written.
    """
    data = png_of(pixels)
    with open(file, "wb") as out:
        out.write(data)


class _Gif:
    """Writes a GIF file. Compressed pictures are kept until close(), because Pillow writes a file at once."""

    def __init__(self, file: str, fps: float) -> None:
        try:
            import PIL.Image  # noqa: F401
        except ImportError:
            raise StageError("GIF files need Pillow: pip install 'stagesim[pictures]'") from None
        # Open the file now, so that an error is raised before the first picture.
        self._out: IO[bytes] = open(file, "wb")
        self._fps = fps
        self._frames: list[bytes] = []
        self._shape: tuple[int, ...] = ()

    def add(self, pixels: Pixels) -> None:
        import zlib

        self._shape = pixels.shape
        self._frames.append(zlib.compress(pixels.tobytes(), 1))

    def close(self) -> None:
        with self._out as out:
            if not self._frames:
                return os.unlink(out.name)
            images = (self._image(index) for index in range(len(self._frames)))
            # GIF durations are multiples of 10 ms. Round the end times, not the durations, to keep the mean rate.
            ends = [round(100 * (i + 1) / self._fps) for i in range(len(self._frames))]
            lengths = [10 * (end - begin) for begin, end in zip([0, *ends], ends)]
            next(images).save(out, "GIF", save_all=True, append_images=images, loop=0,
                              duration=lengths, optimize=False)

    def _image(self, index: int) -> Any:
        import zlib

        from PIL import Image

        height, width, _ = self._shape
        image = Image.frombytes("RGB", (width, height), zlib.decompress(self._frames[index]))
        return image.quantize(256, dither=Image.Dither.NONE)


class _Video:
    """Pipes the pictures to the program ffmpeg, which chooses the format by the file's name."""

    def __init__(self, file: str, fps: float) -> None:
        import shutil

        program = shutil.which("ffmpeg")
        if program is None:
            raise StageError(f"{file} needs the program ffmpeg, which is not on PATH: "
                             "install it, or make a .gif")
        self._program = program
        self._file = file
        self._fps = fps
        self._process: subprocess.Popen[bytes] | None = None

    def add(self, pixels: Pixels) -> None:
        if self._process is None:
            self._process = self._start(pixels.shape[1], pixels.shape[0])
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(pixels.tobytes())
        except BrokenPipeError:
            self.close()  # raises the error with ffmpeg's message
            raise StageError(f"{self._file} can't be written: ffmpeg has ended") from None

    def _start(self, width: int, height: int) -> subprocess.Popen[bytes]:
        import subprocess

        # Pad to an even size and use 4:2:0, because many players support nothing else.
        return subprocess.Popen(
            [self._program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
             "-s", f"{width}x{height}", "-r", f"{self._fps:.6f}", "-i", "-",
             "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", self._path()],
            # A session of its own keeps Ctrl-C from ffmpeg, so that Python can finish the film.
            stdin=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)

    def _path(self) -> str:
        """The file as a URL, which ffmpeg takes neither for an option nor for another protocol."""
        return "file:" + self._file

    def close(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        _, said = process.communicate()
        if process.returncode != 0:
            lines = said.decode(errors="replace").strip().splitlines() or ["it says nothing"]
            raise StageError(f"{self._file} can't be written: ffmpeg: {lines[-1]}")


class Film:
    """Records a film of a world.

    Use it in a `with` statement, which finishes the file even after an exception:

        with st.Film("run.gif", world, every=0.5) as film:
            for _ in range(600):
                world.step()
                film.take()

    Args:
        file: the file; it is overwritten. The ending .gif needs Pillow (`pip install 'stagesim[pictures]'`);
            other endings, such as .mp4, .mkv or .webm, need the program ffmpeg.
        world: the world to record. It may be reset and restored during the film.
        every: simulated seconds between two pictures; None: one picture per call of take().
        fps: pictures per second of the film, more than 0, up to 1000; None: real time, 1 / (every or
            world.dt). GIF files are limited to 50.
        width, height, center, scale, data: as in World.render(). `center` and `scale` default to the view that
            fits the world at the first picture, for the whole film.

    Raises:
        StageError: Pillow or ffmpeg is missing, or ffmpeg fails.
        OSError: the file can't be written.
        ValueError: an argument is out of range.
    """

    def __init__(self, file: str | os.PathLike[str], world: World, *, every: float | None = None,
                 fps: float | None = None, width: int = 640, height: int = 480,
                 center: tuple[float, float] | None = None, scale: float | None = None,
                 data: bool = True) -> None:
        if every is not None and not 0 < every < float("inf"):
            raise ValueError(f"found {every} seconds between pictures, expected more than 0")
        rate = 1 / (every or world.dt) if fps is None else fps
        if not 0 < rate <= 1000:
            raise ValueError(f"found {rate} pictures a second, expected more than 0, up to 1000")
        path = os.fspath(file)
        is_gif = path.lower().endswith(".gif")
        if is_gif:
            rate = min(rate, 50)
        self.world = world  #: the world that is recorded
        self.count = 0  #: number of pictures so far
        self._every = every
        self._last = -1  # time of the last picture, in units of `every`
        self._view: dict[str, Any] = dict(width=width, height=height, center=center, scale=scale,
                                          data=data)
        self._file: _Gif | _Video | None = _Gif(path, rate) if is_gif else _Video(path, rate)

    def take(self) -> bool:
        """Adds a picture of the world if one is due.

        Returns:
            True if a picture was added.

        Raises:
            StageError: the film is closed, or ffmpeg fails.
        """
        if self._file is None:
            raise StageError("the film is finished")
        if not self._is_due(self.world.time):
            return False
        if self.count == 0:
            self._fix_view()
        self._file.add(self.world.render(**self._view))
        self.count += 1
        return True

    def _is_due(self, now: float) -> bool:
        """True once per multiple of `every`, so that the mean rate is right for any length of the steps."""
        if self._every is None:
            return True
        number = int(now / self._every + 1e-6)
        if number == self._last:
            return False
        self._last = number
        return True

    def _fix_view(self) -> None:
        view = self._view
        x, y, scale = self.world._core.fit(view["width"], view["height"])
        view["center"] = (x, y) if view["center"] is None else view["center"]
        view["scale"] = scale if view["scale"] is None else view["scale"]

    def close(self) -> None:
        """Finishes the file. Further calls have no effect."""
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def __enter__(self) -> Film:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Film of {self.count} pictures>"
