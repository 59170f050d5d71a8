# SPDX-License-Identifier: GPL-2.0-or-later
"""The page of stagesim.live in headless Chromium.

Screenshots for inspection are in the folder live_pages of the build tree or of the folder for temporary files.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import stagesim as st

pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
from browser import Browser, find_browser  # noqa: E402
from patience import PATIENCE  # noqa: E402
from stagesim.live import Server  # noqa: E402

pytestmark = pytest.mark.skipif(find_browser() is None, reason="Chromium is not installed: tools/setup --browser")

PICTURES = Path(os.environ.get("STAGE_BINARY_DIR") or tempfile.gettempdir()) / "live_pages"
# A checksum of the drawn pixels.
PIXELS = """(() => {
  const canvas = document.getElementById("view");
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) sum = (sum * 31 + data[i] + 7 * data[i + 1] + 13 * data[i + 2]) % 1000000007;
  return sum;
})()"""
COLOURS = """(() => {
  const canvas = document.getElementById("view");
  const data = new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer);
  return new Set(data).size;
})()"""
Look = Callable[..., tuple[Server, Browser]]


def text(name: str) -> str:
    return f"document.getElementById('{name}').textContent"


def centre(browser: Browser, name: str) -> tuple[float, float]:
    """The center of an element of the page."""
    box = f"document.getElementById('{name}').getBoundingClientRect()"
    return (browser.value(f"{box}.left + {box}.width / 2"), browser.value(f"{box}.top + {box}.height / 2"))


def press(browser: Browser, name: str) -> None:
    browser.click(*centre(browser, name))


@pytest.fixture
def look() -> Iterator[Look]:
    """A function that opens the page of a world."""
    PICTURES.mkdir(exist_ok=True)
    open_ones: list[tuple[Server, Browser]] = []

    def begin(world: st.World, *, dark: bool = False, width: int = 1200, **options: object) -> tuple[Server, Browser]:
        server = Server(world, **options).start()  # type: ignore[arg-type]
        browser = Browser(width, 760, dark=dark)
        open_ones.append((server, browser))
        browser.open(server.url)
        browser.wait(f"{text('note')}.includes('robot')")
        return server, browser

    yield begin
    for server, browser in open_ones:
        errors = browser.errors
        browser.__exit__(None, None, None)
        server.stop()
        assert errors == []


def places(server: Server) -> dict[str, tuple[float, float, float]]:
    return server.run.order(lambda run: {model.name: model.global_pose for model in run.world.models}).result(PATIENCE)


def screen_of(browser: Browser, server: Server, name: str) -> tuple[float, float]:
    """The pixel of a model after fitting the view, by the view that the page exposes."""
    x, y, _ = places(server)[name]
    scale, left, top = (browser.value(f"Number(document.body.dataset.{part})") for part in ("scale", "left", "top"))
    return (x - left) * scale, (top - y) * scale


def test_moves_and_pauses(look: Look) -> None:
    server, browser = look(st.World("simple.world"), speed=5)
    assert browser.value("document.title").startswith("simple.world")
    assert browser.value(text("world")) == "simple.world"
    browser.wait(f"{COLOURS} > 10")
    before = browser.value(PIXELS)
    browser.wait(f"{PIXELS} !== {before}")
    press(browser, "pause")
    browser.wait(f"{text('note')}.includes('paused')")
    assert server.run.order(lambda run: run._paused).result(PATIENCE)
    browser.wait(f"(() => {{ const a = {PIXELS}; return a === {PIXELS}; }})()")
    still, clock = browser.value(PIXELS), browser.value(text("clock"))
    time.sleep(0.5)
    assert (browser.value(PIXELS), browser.value(text("clock"))) == (still, clock)
    browser.screenshot(PICTURES / "simple.png")
    browser.key(" ", "Space")
    browser.wait(f"{text('clock')} !== '{clock}'")


def test_page_shows_that_it_is_loading_until_the_first_frame() -> None:
    """The page shows that it is loading while a long first step delays the first frame, and lost connections."""
    go_on = threading.Event()

    def control(world: st.World) -> None:
        go_on.wait()

    with Server(st.World("simple.world"), speed=0, control=control) as server, Browser() as browser:
        do = server.run.order(lambda run: go_on.wait(PATIENCE))  # blocks the run, so that it makes no frame
        browser.open(server.url)
        browser.wait("document.getElementById('light').classList.contains('on')")
        time.sleep(0.5)
        assert browser.value(text("note")) == "loading"
        go_on.set()
        do.result(PATIENCE)
        browser.wait(f"{text('note')}.includes('2 robots')")
        server.stop()
        browser.wait(f"{text('note')} === 'no connection'")


def test_step_speed_and_seed(look: Look) -> None:
    server, browser = look(st.World("cave.world"), paused=True)
    press(browser, "step")
    browser.wait(f"{text('clock')} === '0:00.1'")
    browser.key(".", "Period")
    browser.wait(f"{text('clock')} === '0:00.2'")
    browser.value("document.querySelector('#speeds button[value=\"5\"]').click()")
    browser.wait("document.querySelector('#speeds button[value=\"5\"]').getAttribute('aria-checked') === 'true'")
    browser.value("document.getElementById('seed').value = '12345'")
    press(browser, "reset")
    browser.wait(f"{text('clock')} === '0:00.0'")
    assert server.run.order(lambda run: (run.world.seed, run._speed)).result(PATIENCE) == (12345, 5.0)
    press(browser, "pause")
    browser.wait(f"parseFloat({text('rate-now')}) > 4.5 && parseInt({text('r_acc-now')}) > 450")
    browser.screenshot(PICTURES / "cave.png")


def test_choose_drag_and_drive(look: Look, room: str) -> None:
    server, browser = look(st.World.from_text(room), paused=True)
    at = screen_of(browser, server, "b")
    browser.click(*at)
    browser.wait(f"{text('chosen-name')} === 'b'")
    browser.mouse("Pressed", *at)
    for share in (0.3, 0.6, 1.0):
        browser.mouse("Moved", at[0] + 120 * share, at[1] + 40 * share)
    browser.mouse("Released", at[0] + 120, at[1] + 40)
    scale = browser.value("Number(document.body.dataset.scale)")
    deadline = time.monotonic() + PATIENCE
    while abs(places(server)["b"][0] - 120 / scale) > 0.02:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert places(server)["b"] == pytest.approx((120 / scale, 2 - 40 / scale, 1.5708), abs=0.02)
    assert places(server)["a"] == (0, 0, 0)
    browser.key(" ", "Space")
    before = places(server)["b"]
    browser.key("ArrowUp", "ArrowUp", up=False)
    browser.wait(f"{text('chosen-facts')}.includes('0.50 m/s')")
    browser.key("ArrowUp", "ArrowUp", down=False)
    browser.wait(f"{text('chosen-facts')}.includes('0.00 m/s')")
    assert places(server)["b"][1] > before[1]
    press(browser, "sense")
    browser.wait(f"{text('sense')} === 'Sensing'")
    browser.screenshot(PICTURES / "room.png")
    browser.key("Escape", "Escape")
    browser.wait("document.getElementById('chosen').hidden")


def test_a_click_selects_robots_before_things_below_them(look: Look) -> None:
    """A click selects robots before the things below them, and movable things only by their bodies."""
    server, browser = look(st.World.from_text("""
model( name "ring" size [6 6 1] block( points 4 point[0] [0 0] point[1] [6 0] point[2] [6 6] point[3] [0 6] z [0 1] )
       block( points 4 point[0] [1 1] point[1] [5 1] point[2] [5 5] point[3] [1 5] z [0 1] ) )
model( name "wall" pose [5 0 0 0] size [1 1 1] gui_move 0 )
position( name "r" pose [-2.5 0 1 0] size [0.5 0.5 0.5] )
"""), paused=True)
    scale, left, top = (browser.value(f"Number(document.body.dataset.{part})") for part in ("scale", "left", "top"))
    for x, y, name in ((2.5, 1, "ring"), (0, 0, None), (-2.5, 0.1, "r"), (5, 0, None), (-2.5, 2, "ring")):
        browser.click((x - left) * scale, (top - y) * scale)
        browser.wait("document.getElementById('chosen').hidden" if name is None else
                     f"{text('chosen-name')} === '{name}' && !document.getElementById('chosen').hidden")


def test_zoom_and_fit(look: Look) -> None:
    _, browser = look(st.World("hospital.world"), paused=True, dark=True)
    fitted = browser.value("Number(document.body.dataset.scale)")
    browser.wheel(300, 300, -800)
    browser.wait(f"Number(document.body.dataset.scale) > {2 * fitted}")
    browser.mouse("Pressed", 50, 400)
    left = browser.value("Number(document.body.dataset.left)")
    browser.mouse("Moved", 150, 400)
    browser.mouse("Released", 150, 400)
    browser.wait(f"Number(document.body.dataset.left) < {left}")
    press(browser, "fit")
    browser.wait(f"Number(document.body.dataset.scale) === {fitted}")
    browser.screenshot(PICTURES / "hospital.png")


def test_page_reconnects_after_a_restart_of_the_server(look: Look, room: str) -> None:
    server, browser = look(st.World.from_text(room))
    port = int(server.url.split(":")[2].rstrip("/"))
    server.stop()
    browser.wait(f"{text('note')} === 'no connection'")
    with Server(st.World("simple.world"), port=port):
        browser.wait(f"{text('world')} === 'simple.world' && {text('note')} === '2 robots'")
    browser.wait(f"{text('note')} === 'no connection'")
    browser.errors.clear()  # discards errors of refused connections


@pytest.mark.parametrize("width", [390, 820])
def test_page_fits_small_screens(look: Look, width: int) -> None:
    """The page fits small screens."""
    _, browser = look(st.World("simple.world"), paused=True, width=width)
    sizes = "[...document.querySelectorAll('.card, button')].map((part) => part.getBoundingClientRect())"
    assert browser.value(f"{sizes}.every((box) => box.left >= 0 && box.right <= innerWidth)")
    browser.screenshot(PICTURES / f"small_{width}.png")


FLOOR = """resolution 0.05
field( name "trail" size [8 4 0] field_resolution 1 color "green" )
light( name "lamp" pose [-2 -4 0 0] size [0.1 0.1 0.1] intensity 16 color "red" )
position( name "r" pose [2 4 0 0] size [0.4 0.4 0.4] )
"""


def test_fields_and_lights_lie_on_the_floor_and_change(look: Look) -> None:
    server, browser = look(st.World.from_text(FLOOR), paused=True)

    def color(x: float, y: float) -> str:
        scale, left, top = (browser.value(f"Number(document.body.dataset.{part})") for part in ("scale", "left", "top"))
        ratio = "Math.min(devicePixelRatio || 1, 2)"
        return ("(() => { const canvas = document.getElementById('view'); return Array.from(canvas.getContext('2d')"
                f".getImageData({(x - left) * scale} * {ratio}, {(top - y) * scale} * {ratio}, 1, 1).data).join(); }})()")

    def setting(name: str, value: object) -> None:
        server.run.order(lambda run: setattr(run.world.fields["trail"] if name == "values" else run.world.model("lamp"),
                                             name, value)).result(PATIENCE)

    empty = browser.value(color(0.25, 4.2))
    assert browser.value(color(-3.4, 1.4)) == empty
    values = np.zeros((4, 8))
    values[3, 0], values[0, 7] = 4, 2  # the north-west and the south-east
    setting("values", values)
    browser.wait(f"{color(-3.4, 1.4)} !== '{empty}'")
    strong, weak, none = (list(map(int, browser.value(color(*place)).split(",")))
                          for place in ((-3.4, 1.4), (3.4, -1.4), (3.4, 1.4)))
    assert strong[1] - strong[0] > weak[1] - weak[0] + 50 > none[1] - none[0] + 100
    red, _, blue, _ = map(int, browser.value(color(-1.4, -4)).split(","))
    assert red > blue + 20
    browser.screenshot(PICTURES / "floor.png")
    setting("on", False)
    browser.wait(f"{color(-1.4, -4)} === '{empty}'")
    setting("values", np.zeros((4, 8)))
    browser.wait(f"{color(-3.4, 1.4)} === '{empty}'")


@pytest.mark.parametrize("file", st.shipped_worlds())
def test_every_shipped_world_is_drawn(look: Look, file: str) -> None:
    _, browser = look(st.World(file), paused=True)
    browser.wait(f"{COLOURS} > 4")
