# SPDX-License-Identifier: GPL-2.0-or-later
"""stagesim.live: access control, start and stop, and the command lines."""

from __future__ import annotations

import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import stagesim as st

pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
from live_client import Client, do  # noqa: E402
from patience import PATIENCE, slowness  # noqa: E402
from stagesim.live import Run, Server  # noqa: E402
from stagesim.live.__main__ import arguments, parsed  # noqa: E402
from stagesim.live.messages import order_of  # noqa: E402
from websockets.exceptions import InvalidStatus  # noqa: E402

# ---- access ----------

def get(server: Server, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", urlsplit(server.url).port, timeout=PATIENCE)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    return connection.getresponse()


def test_page(server: Server) -> None:
    """The page loads nothing from other servers."""
    answer = get(server, "/")
    text = answer.read().decode()
    assert answer.status == 200 and answer.getheader("Content-Type") == "text/html; charset=utf-8"
    assert "default-src 'self'" in str(answer.getheader("Content-Security-Policy"))
    assert "http://" not in text and "https://" not in text
    names = {file.name for file in (Path(st.__file__).parent / "live" / "page").iterdir()}
    assert {"index.html", "style.css", "main.js"} <= names
    for name in names:
        assert get(server, f"/{name}").status == 200


@pytest.mark.parametrize("path", ["/nothing", "/../scene.py", "/..%2fscene.py", "//etc/passwd", "/page/../web.py",
                                  "/%2e%2e/web.py", "/index.html/", "/./index.html", "/\\..\\web.py"])
def test_other_paths_are_not_found(server: Server, path: str) -> None:
    assert get(server, path).status == 404


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "localhost.evil.example", "", "[::1",
                                  "127.0.0.1.nip.io"])
def test_requests_with_a_foreign_host_are_refused(server: Server, host: str) -> None:
    """Foreign host names, as with DNS rebinding, are refused."""
    assert get(server, "/", Host=host).status == 403
    assert get(server, "/live", Host=host).status == 403


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost:1234", "[::1]:80", "LOCALHOST"])
def test_requests_with_the_own_host_are_accepted(server: Server, host: str) -> None:
    assert get(server, "/", Host=host).status == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "http://localhost",
                                    "file://"])
def test_connections_from_foreign_origins_are_refused(server: Server, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        Client(server, origin=origin)


def test_connections_from_the_own_origin_are_accepted(server: Server) -> None:
    with Client(server, origin=server.url.rstrip("/")) as client:
        client.until(lambda: True)


def test_other_machines_need_the_token(room: str) -> None:
    """Clients need the token if other machines can reach the server."""
    with Server(st.World.from_text(room), host="0.0.0.0", paused=True) as server:  # noqa: S104
        assert f"//{socket.gethostname()}:" in server.url and "?token=" in server.url
        server.url = server.url.replace(f"//{socket.gethostname()}:", "//127.0.0.1:")
        with Client(server) as client:
            client.until(lambda: True)
        for query in ("", "?token=", "?token=guessed", "?token=%ff"):
            assert get(server, f"/live{query}").status == 403
        assert get(server, "/").status == 200


def test_server_listens_only_on_the_loopback_interface(server: Server) -> None:
    assert server.url.startswith("http://127.0.0.1:") and "token" not in server.url


# ---- beginning and end ----

def test_port_in_use(server: Server, room: str) -> None:
    with pytest.raises(st.StageError, match="can't serve at 127.0.0.1"):
        Server(st.World.from_text(room), port=urlsplit(server.url).port).start()


def test_the_world_can_be_used_after_the_server_has_stopped(room: str) -> None:
    world = st.World.from_text(room)
    for _ in range(3):
        with Server(world, speed=0):
            time.sleep(0.05)
        steps = world.steps
        assert world.step(2) == 2 and world.steps == steps + 2


def test_actions_on_a_closed_world_are_errors(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        do(server, lambda run: run.world.close())
        client.send("step", count=1)
        assert client.until_error()
    assert get(server, "/").status == 200


def test_orders_after_the_end_raise_an_error(room: str) -> None:
    run = Run(st.World.from_text(room))
    run.start()
    run.stop()
    with pytest.raises(st.GoneError):
        run.order(lambda run: None).result(PATIENCE)


def test_orders_of_the_docstring_are_accepted() -> None:
    for order in ('{"do": "pause", "on": true}', '{"do": "speed", "factor": 2}', '{"do": "step", "count": 1}',
                  '{"do": "reset", "seed": null}', '{"do": "move", "thing": 1, "pose": [1, 2, 3]}',
                  '{"do": "drive", "thing": 1, "velocity": [1, 2, 3]}', '{"do": "sense", "thing": 1}',
                  '{"do": "watch", "chosen": null, "scans": [], "all": true}'):
        assert callable(order_of(order, None))
        name = json.loads(order)["do"]
        assert f'"{name}"' in str(order_of.__doc__)


def test_page_of_the_documentation(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The commands of docs/live.md work, and it documents all options."""
    page = root / "docs" / "live.md"
    if not page.exists():
        pytest.skip("there is no docs/live.md")
    for code in re.findall(r"```python\n(.*?)```", page.read_text(), re.S):
        exec(compile(code, str(page), "exec"), {})  # noqa: S102
    printed = capsys.readouterr().out
    assert printed.startswith("http://127.0.0.1:") and printed.count("\n") == 2
    for option in arguments()._option_string_actions:
        assert option in ("-h", "--help", "--opencl-always") or f"`{option}" in page.read_text(), option


@pytest.mark.parametrize(("words", "device", "foxglove"), [
    ([], None, None), (["--opencl"], "", None), (["--opencl=gpu"], "gpu", None),
    (["--foxglove"], None, 8765), (["--opencl", "--foxglove"], "", 8765), (["--foxglove", "9"], None, 9)])
def test_options_without_a_value_leave_the_world_alone(words: list[str], device: str | None,
                                                       foxglove: int | None) -> None:
    for line in ([*words, "cave.world"], ["cave.world", *words]):
        options = parsed(line)
        assert (options.world, getattr(options, "opencl", None), options.foxglove) == ("cave.world", device, foxglove)


def command(*words: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-m", "stagesim.live", *words], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, env=dict(os.environ, DISPLAY="", WAYLAND_DISPLAY=""))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_command(number: int) -> None:
    """The command prints one line with the address, and a signal ends it at once."""
    process = command("cave.world", "--port", "0", "--seed", "7")
    assert process.stdout is not None
    line = process.stdout.readline()
    port = urlsplit(line.strip()).port
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request("GET", "/")
    assert connection.getresponse().status == 200
    began = time.monotonic()
    process.send_signal(number)
    rest, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, rest, errors) == (0, "", "")
    assert time.monotonic() - began < 3 * slowness()


@pytest.mark.parametrize(("words", "status", "text"), [
    (["nothing.world"], 1, "stage: nothing.world: "),
    (["cave.world", "--port", "70000"], 2, "found '70000', expected a port"),
    (["cave.world", "--speed", "-1"], 1, "stage: found the speed -1.0"),
    (["--foxglove", "nothing.world"], 1, "stage: nothing.world: "),
    (["cave.world", "--threads", "0"], 1, "stage: found 0 as threads"),
    (["cave.world", "--host", "203.0.113.7"], 1, "stage: can't serve at 203.0.113.7"),
    ([], 2, "WORLD")])
def test_command_reports_an_error_without_a_traceback(words: list[str], status: int, text: str) -> None:
    process = command(*words)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == status and text in errors and "Traceback" not in errors


# ---- the program ----

PROGRAM = Path(st.__file__).parent / "bin" / "stage"


def stage(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(PROGRAM), *words], capture_output=True, text=True, check=False, timeout=PATIENCE,
                          env={**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": "", **environment})


def test_program(tmp_path: Path) -> None:
    """`stage --live` runs the module with its options and imports nothing from the working folder."""
    (tmp_path / "stagesim.py").write_text("raise SystemExit('a file of the working folder was imported')")
    (tmp_path / "w.world").write_text('position( name "r" )')
    process = subprocess.Popen(
        [str(PROGRAM), "--live=0", "w.world", "--seed", "7", "--no-controllers", "--ray-model", "exact"], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": "", "STAGE_PYTHON": sys.executable})
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    assert address.startswith("http://127.0.0.1:")

    class Served:
        url = address

    with Client(Served()) as client:  # type: ignore[arg-type]
        client.until(lambda: client.frame["time"] > 0.2)
        assert (client.frame["seed"], client.frame["speed"], client.scene["world"]) == ("7", 1, "w.world")
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=PATIENCE) == ("", "") and process.returncode == 0


@pytest.mark.parametrize(("words", "status", "text"), [
    (["--live"], 2, "found no world file"),
    (["--live", "a.world", "b.world"], 2, "--live: found 2 world files, expected one"),
    (["--live=x", "a.world"], 2, "--live: found 'x', expected nothing, or a port"),
    (["--foxglove=65536", "a.world"], 2, "--foxglove: found '65536'"),
    (["--live", "--stats", "s.json", "a.world"], 2, "--stats does not go with --live"),
    (["--live", "--screenshot", "s.png", "a.world"], 2, "--screenshot does not go with --live"),
    (["--live=0", "nothing.world"], 1, "stage: nothing.world: ")])
def test_program_reports_an_error_without_a_traceback(words: list[str], status: int, text: str, tmp_path: Path,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = stage(*words, STAGE_PYTHON=sys.executable)
    assert done.returncode == status and text in done.stderr and done.stderr.count("\n") == 1, done


def test_program_without_python(tmp_path: Path) -> None:
    """One line names the missing interpreter or package."""
    (tmp_path / "w.world").touch()
    done = stage("--live", str(tmp_path / "w.world"), STAGE_PYTHON="/nowhere/python3")
    assert (done.returncode, done.stderr.count("\n")) == (1, 1) and "'/nowhere/python3' (STAGE_PYTHON)" in done.stderr
    (tmp_path / "bin").mkdir()
    alone = shutil.copy(os.path.realpath(PROGRAM), tmp_path / "bin" / "stage")
    libraries = os.path.dirname(os.path.realpath(PROGRAM.parent.parent / "lib" / f"libstage.so.{st.__version__}"))
    done = subprocess.run([alone, "--live", str(tmp_path / "w.world")], capture_output=True, text=True, check=False,
                          env={"PATH": os.environ["PATH"], "LD_LIBRARY_PATH": libraries,
                               "STAGE_PYTHON": sys.executable, "PYTHONNOUSERSITE": "1"})
    if done.returncode == 1:  # the package is not installed for this interpreter
        assert done.stderr.startswith("stage: can't load the Python package stagesim: ")
        assert done.stderr.count("\n") == 1
