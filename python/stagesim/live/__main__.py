# SPDX-License-Identifier: GPL-2.0-or-later
"""Shows a running world in a browser: `python -m stagesim.live WORLD`."""

from __future__ import annotations

import argparse
import signal
import sys
import threading
from collections.abc import Sequence

from .. import _options
from ..errors import StageError
from ..world import World
from .command_line import open_page, port_of, with_port
from .server import Server

PORT, FOXGLOVE_PORT = 8642, 8765


def arguments() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m stagesim.live", description="Runs a world and shows it in a browser.", allow_abbrev=False)
    parser.add_argument("world", metavar="WORLD", help="a world file, or the name of a shipped world")
    parser.add_argument("--port", type=port_of, default=PORT, metavar="N",
                        help=f"port of the page (default {PORT}); 0: any free port")
    parser.add_argument("--host", default="127.0.0.1", metavar="ADDRESS",
                        help="address to serve at (default 127.0.0.1: only for programs of this machine)")
    parser.add_argument("--foxglove", type=port_of, nargs="?", const=FOXGLOVE_PORT, metavar="PORT",
                        help=f"also serve Foxglove at PORT (default {FOXGLOVE_PORT})")
    parser.add_argument("--no-browser", action="store_true", help="don't open the page")
    parser.add_argument("--speed", type=float, metavar="X",
                        help="simulated seconds per real second; 0: as fast as possible (default: that of the"
                             " world file, or else 1)")
    parser.add_argument("--paused", action="store_true", help="start paused")
    _options.add_to(parser)
    return parser


def server_of(options: argparse.Namespace) -> Server:
    """Makes the server for the options; it is not started yet."""
    return Server(World(options.world, **_options.given_in(options)), host=options.host, port=options.port,
                  foxglove=options.foxglove, speed=options.speed, paused=options.paused)


def show(server: Server, browser: bool) -> None:
    """Runs the server until SIGINT (Ctrl-C) or SIGTERM."""
    over = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: over.set())
    with server:
        line = server.url
        if server.foxglove_url:
            line += f"  Foxglove: {server.foxglove_url}"
        print(line, flush=True)
        if browser:
            open_page(server.url)
        over.wait()


def parsed(words: Sequence[str]) -> argparse.Namespace:
    """Parses the arguments. Options with an optional value accept it only as --opt=VALUE; see with_port()."""
    return arguments().parse_args(with_port(_options.unambiguous(words), "--foxglove", FOXGLOVE_PORT))


def main() -> int:
    """Returns the exit status: 1 if the world can't be loaded or a port can't be opened."""
    options = parsed(sys.argv[1:])
    try:
        show(server_of(options), not options.no_browser)
    except (StageError, ValueError) as error:
        print(f"stage: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:  # Ctrl-C while the world is being loaded
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
