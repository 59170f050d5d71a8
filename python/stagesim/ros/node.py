# SPDX-License-Identifier: GPL-2.0-or-later
"""The node: a world, the topics of its robots, and services such as reset, pause and step.

A single thread does all work. Between two steps it handles the messages that have arrived; then it makes a step
and publishes the topics with subscribers. Therefore commands take effect between steps, in the order of arrival.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping

import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Header
from std_srvs.srv import Empty, SetBool, Trigger

from .._core import Model, Snapshot
from ..errors import StageError
from ..log import Log
from ..pace import Pace
from ..world import World
from .clock import ClockFeed
from .executor import Executor
from .feeds import Feed
from .load import LoadFeed
from .lockstep import Lockstep, split
from .map_feed import MapFeed
from .parameters import declare
from .spawning import spawn
from .team import Kept, Team
from .topics import RATES

MAX_STEPS = 1_000_000  #: max steps that a client may ask for

if TYPE_CHECKING:
    from ..live.server import Server
    from .robots import Robot
    from .standard_services import StandardServices
    from .window import NodeRun

#: Seconds of real time between checks for subscribers, and between repeated messages in lock-step.
LISTENERS_PERIOD, REPEAT_PERIOD = 0.1, 0.5
#: Max delay in real time that the world catches up, seconds. Longer delays make it slower.
MAX_DELAY = 0.05


def write_snapshot(file: Path, data: bytes) -> None:
    """Writes the bytes of a snapshot into a file; an earlier snapshot is replaced.

    Raises:
        StageError: the file holds something else.
        OSError: it can't be read or written.
    """
    magic = data[:8]
    if file.exists():
        with open(file, "rb") as present:
            if present.read(len(magic)) not in (b"", magic):
                raise StageError(f"{file}: found something else than a snapshot, expected a new name or an earlier "
                                 "snapshot; the parameter snapshot_file names it")
    file.write_bytes(data)


def standard_services(node: StageNode, frame: str, most_steps: int) -> StandardServices | None:
    """The services of simulation_interfaces; None after a line for debugging if that package is not there."""
    try:
        from .standard_services import StandardServices
    except ModuleNotFoundError as error:
        node.get_logger().debug(f"no standard services: there is no Python module {error.name}; docs/ros.md says how "
                                "to make it (python -m stagesim.ros.make_messages simulation_interfaces)")
        return None
    return StandardServices(node, frame, most_steps)


class StageNode(Node):
    """The ROS 2 node of a world.

    Args:
        world: the world; None: there is none yet, see LifecycleStageNode.
        name: name of the node.
        parameters: values of parameters by name; those of the command line take precedence.
        gui: port of the page that shows the world while run() runs; 0: any free port; None: the page is shown
            at any free port if the parameter `gui` is true.
        log_file: an MCAP file in which the world is recorded until close(); None: the parameter `log_file`.

    Attributes:
        team: the robots.
        spawned: models that clients have made; some may be gone.
        times: seconds of real time spent so far: in "step", "publish" and "answer" (callbacks).
        silent: True: nothing is published, and no steps are made.
        paused: True: the world is paused.
        steps_asked: number of steps still to make while paused.
        url: address of the page; empty: no page.

    Raises:
        ValueError: a parameter has an invalid value.
        GoneError: the world has no robot.
        StageError: the page can't be served, or the log can't be written.
    """

    def __init__(self, world: World | None, name: str = "stage", parameters: Mapping[str, Any] | None = None,
                 gui: int | None = None, log_file: str | None = None) -> None:
        super().__init__(name, parameter_overrides=[Parameter(key, value=value)
                                                    for key, value in (parameters or {}).items()])
        self.times = {"step": 0.0, "publish": 0.0, "answer": 0.0}
        self.url = ""
        self.silent = False
        self._window: NodeRun | None = None
        self._server: Server | None = None
        self._executor = Executor(self)
        self._standard: StandardServices | None = None
        self._log: Log | None = None
        self._log_file = log_file
        try:
            self._start(world, gui)
        except BaseException:
            self.close()
            raise

    def _start(self, world: World | None, gui: int | None) -> None:
        """Declares parameters and loads the world."""
        declare(self)
        declare(self, RATES)
        if world is not None:
            self._load(world, gui)

    def _load(self, world: World, gui: int | None) -> None:
        """Makes robots, publishers, subscriptions and services by the parameters, and the page."""
        self.world = world
        self.paused = self.value("paused")
        self._snapshot: Snapshot | None = None
        self._kept: Kept | None = None  # beside the snapshot
        self._last_look = 0.0
        self._pace = Pace(self.speed, not self.paused, MAX_DELAY)
        self.team = Team(self)
        self.spawned: list[Model] = []
        self._time_feed = ClockFeed(self, self.value("clock_rate"))
        self._map_feed = MapFeed(self) if self.value("publish_map") else None
        self._load_feed = LoadFeed(self)
        self.create_subscription(Header, "~/done", self._done, 10)
        self._make_services()
        self._set_lockstep()
        self._on_world_reset()
        self._standard = standard_services(self, self.value("map_frame_id"), MAX_STEPS)
        file = self._log_file or self.value("log_file")
        self._log = world.log(file) if file else None
        if gui is not None or self.value("gui"):
            self._open_window(gui or 0)

    def _open_window(self, port: int) -> None:
        from .window import open_window  # imported here, because it needs more packages

        self._window, self._server = open_window(self, self._executor.wake, port)
        self.url = self._server.url
        self.get_logger().info(f"the window is the page {self.url}")

    def value(self, name: str) -> Any:
        """The value of a parameter."""
        return self.get_parameter(name).value

    # ---- publishing ----

    @property
    def now(self) -> int:
        """Simulated time, microseconds."""
        return round(self.world.time * 1e6)

    @property
    def _step_time(self) -> int:
        """Duration of a step, microseconds of simulated time."""
        return round(self.world.dt * 1e6)

    def publish(self, everything: bool = False) -> None:
        """Publishes the new data, or all data, on topics with subscribers."""
        if self.silent:
            return
        start = time.perf_counter()
        now = self.now
        self._check_subscribers()
        if self._map_feed is not None:
            self._map_feed.look(now, at_once=everything)
        self._send(self.team.due(now, self._step_time, everything), everything)
        self.times["publish"] += time.perf_counter() - start

    def _send(self, feeds: list[Feed], everything: bool) -> None:
        """Publishes the time, then transforms, then data, so that a stamp's time and frames precede its data."""
        now, step = self.now, self._step_time
        self._time_feed.tell(now, always=self.paused or self._lockstep.is_used)
        self.team.send_transforms(now, everything)
        for feed in feeds:
            feed.send(now, step)

    def _publish_clock_between_steps(self) -> float:
        """Publishes /clock between two steps if it has a fixed rate; returns the real seconds until it is due again."""
        if self._lockstep.is_used or self._pace.is_unlimited:
            return float("inf")
        if self._time_feed.wait() == 0:
            self._time_feed.tell(self.now + int(self._pace.passed(self.world.dt) * 1e6))
        return self._time_feed.wait()

    def _check_subscribers(self) -> list[Feed]:
        """Checks for subscribers once per LISTENERS_PERIOD; returns the feeds that have got their first one."""
        if time.monotonic() - self._last_look < LISTENERS_PERIOD:
            return []
        self._last_look = time.monotonic()
        return self.team.look_for_subscribers()

    def _publish_to_new_subscribers(self) -> None:
        """Publishes the current data to new subscribers, and a map that has changed; called while paused."""
        if self.silent:
            return
        found = self._check_subscribers()
        if found:
            self._send(found, everything=True)
        if self._map_feed is not None:
            self._map_feed.look(self.now)

    # ---- robots ----

    def spawn(self, type: str, name: str = "", pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
              namespace: str = "") -> Model:
        """Makes a robot, which has all of its topics and services at once.

        Args:
            type: a macro of the world file, or of the folder `robots`, such as "turtlebot3_burger".
            name: its name in the world; empty: that of the macro, with a number if need be.
            pose: x, y (metres) and heading (radians) in the map.
            namespace: prefix of its topics and frames; empty: its name.

        Returns:
            The robot's model. A reset of the world deletes it.

        Raises:
            ValueError: an argument is invalid.
            StageError: the robot can't be made.
        """
        made = spawn(self, type, name, pose, namespace)
        self.spawned.append(made)
        self.update_team()
        self.moved()
        return made

    def update_team(self) -> None:
        """Makes the robots' part anew if robots have come or gone; called after each such change."""
        if not self.team.is_outdated():
            return
        self.team = Team(self, self.team)
        self._lockstep.rename(self._lockstep_names())
        if self._all_sensors:
            self.team.attach_sensors()
        self._last_look = 0.0
        if self._window is not None:
            self._window.on_world_reset()

    @property
    def _all_sensors(self) -> bool:
        """True if sensors work without subscribers."""
        return bool(self.value("always_on")) or self._lockstep.is_used

    # ---- clients ----

    @property
    def robots(self) -> list[Robot]:
        """The robots, in the order of Team.robots."""
        return self.team.robots

    def note_call(self) -> None:
        """Called by each callback of a topic with commands, so that the executor looks for more of them."""
        self._executor.calls += 1

    def accepts(self, name: str, header: Header | None) -> bool:
        """Whether a robot takes a command: in lock-step only if it answers for the current time, which ends the wait."""
        if name not in self._lockstep.names:
            return True
        return header is not None and self._is_now(header.stamp) and self._lockstep.answer(name)

    def _is_now(self, stamp: Any) -> bool:
        return stamp.sec * 1_000_000_000 + stamp.nanosec == self.now * 1000

    def _done(self, message: Header) -> None:
        self.note_call()
        if self._is_now(message.stamp):
            self._lockstep.answer(message.frame_id)

    def in_world(self, pose: tuple[float, float, float], frame: str) -> tuple[float, float, float]:
        """Transforms a pose to the map frame: see Frames.in_world()."""
        return self.team.frames.in_world(pose, frame)

    def moved(self) -> None:
        """Called when a client has moved things. While paused, the new poses are published at once."""
        self.team.on_moved()
        if self._window is not None:
            self._window.has_changed()
        if self.paused:
            self.publish(everything=True)

    # ---- services ----

    def _make_services(self) -> None:
        self.create_service(Empty, "/reset_positions", self._reset_positions)
        self.create_service(SetBool, "~/pause", self._pause)
        for name, does in (("reset", self._reset), ("step", self._step), ("snapshot", self._take),
                           ("restore", self._restore)):
            self.create_service(Trigger, f"~/{name}", self._answering(does))

    def _answering(self, does: Any) -> Any:
        """A service handler that reports exceptions in its response instead of ending the node."""
        def handle(_: Any, response: Trigger.Response) -> Trigger.Response:
            try:
                response.message = does()
                response.success = True
            except (StageError, OSError, ValueError) as error:
                response.success = False
                response.message = str(error)
            return response

        return handle

    def _reset_positions(self, _: Any, response: Empty.Response) -> Empty.Response:
        """Moves robots back to their start poses and stops them, as stage_ros does; time goes on."""
        self.team.go_home()
        self.moved()
        return response

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self.pause(request.data)
        response.success = True
        response.message = "paused" if self.paused else "running"
        return response

    def pause(self, on: bool) -> None:
        """Pauses the world or lets it run."""
        self.paused, self.steps_asked = on, 0
        self._pace.change(running=not on)

    def ask_steps(self, count: int) -> None:
        """Makes run() do `count` more steps and then pause."""
        asked = self.steps_asked
        self.pause(True)
        self.steps_asked = min(asked + count, MAX_STEPS)

    def _reset(self) -> str:
        seed = self.value("seed")
        self.reset(None if seed < 0 else seed)
        return f"began anew with the seed {self.world.seed}"

    def reset(self, seed: int | None) -> None:
        """Resets the world with the seed; None: with the current one."""
        self.world.reset(seed)
        self.team.last_command[:] = -1
        self._on_world_reset()

    def _step(self) -> str:
        self._check_active()
        self.pause(True)
        made, wanted = 0, self.value("steps")
        while made < wanted and rclpy.ok() and self.advance():
            made += 1
        return f"made {made} steps: time {self.world.time:g}, state {self.world.state_hash()}"

    def _take(self) -> str:
        self._snapshot = self.world.snapshot()
        self._kept = self.team.kept()
        file = self.value("snapshot_file")
        if file:
            write_snapshot(Path(file), self._snapshot.to_bytes())
        return f"state at {self._snapshot.time:g} s, {self._snapshot.size} bytes"

    def _restore(self) -> str:
        file = self.value("snapshot_file")
        snapshot = Snapshot.from_bytes(Path(file).read_bytes()) if file else self._snapshot
        if snapshot is None:
            raise StageError("found no snapshot, expected the service snapshot to be called before")
        self.world.restore(snapshot)
        last = self.team.last_command
        last[last >= 0] = self.now
        self._on_world_reset(None if file else self._kept)
        return f"went back to {self.world.time:g} s"

    def _on_world_reset(self, kept: Kept | None = None) -> None:
        """Called after loading, a reset or a restore; see Team.begin()."""
        self.steps_asked = 0
        self.update_team()
        self.team.begin(kept, self._all_sensors)
        self._lockstep.begin(self.now, self._step_time)
        self._pace.begin()
        self._time_feed.begin()
        if self._window is not None:
            self._window.on_world_reset()
        self.publish(everything=True)

    # ---- time ----

    def _set_lockstep(self) -> None:
        """Applies the parameters of lock-step. Raises ValueError if they don't fit the others."""
        self._lockstep_taken = self._lockstep_parameters()
        names = self._lockstep_names()
        if names & set(self.team.names) and not self.value("stamped_cmd_vel"):
            raise ValueError("found robots in lockstep, whose commands carry no time; "
                             "expected stamped_cmd_vel:=true")
        self._lockstep = Lockstep(names, round(self._lockstep_taken[1] * 1e6))
        self._lockstep.begin(self.now, self._step_time)

    def _lockstep_names(self) -> set[str]:
        """The robots and programs that the parameter `lockstep` names."""
        names = set(split(self._lockstep_taken[0]))
        return names - {"all"} | set(self.team.names) if "all" in names else names

    def _lockstep_parameters(self) -> tuple[str, float]:
        return self.value("lockstep"), self.value("lockstep_interval")

    def advance(self) -> int:
        """Makes a step and publishes the new data; returns the number of steps made: 0 if the world has ended.

        Raises:
            StageError: the step fails, or the node is silent.
        """
        self._check_active()
        self.team.run_watchdog(self.value("base_watchdog_timeout"))
        start = time.perf_counter()
        made = self.world.step()
        self.times["step"] += time.perf_counter() - start
        self.team.step()
        if self._window is not None:
            self._window.has_changed(note="")
        if made:
            self._lockstep.begin(self.now, self._step_time)
            self.publish()
        return made

    def _check_active(self) -> None:
        if self.silent:
            raise StageError("found an inactive node, expected the transition activate before steps")

    def run(self, duration: float = float("inf")) -> None:
        """Runs until ROS is shut down, the world ends or its time reaches `duration` (seconds).

        Raises:
            ValueError: a changed parameter doesn't fit the others.
        """
        while rclpy.ok() and self.world.time < duration and not self.world.ended:
            self._turn()

    def _turn(self) -> None:
        """Makes a step if one is due, and serves ROS."""
        self._load_feed.look()
        if self._lockstep_parameters() != self._lockstep_taken:
            self._set_lockstep()
        dt = self.world.dt
        self._pace.change(speed=self.speed)
        if self._standard is not None and self._standard.turn():
            self._answer(0.0)
        elif self.steps_asked:
            self.steps_asked -= 1
            self.advance()
            self._answer(0.0)
        elif self.paused:
            self._answer(0.05)
            self._publish_to_new_subscribers()
        elif self._lockstep.missing():
            self._wait_for_clients()
        elif self._pace.is_due(dt):
            self._pace.made(dt)
            self.advance()
            self._answer(0.0)
        else:
            self._answer(min(self._pace.wait(dt), self._publish_clock_between_steps(), 0.1))

    def _wait_for_clients(self) -> None:
        self._answer(0.02)
        missing = ", ".join(self._lockstep.missing())
        if missing and self._lockstep.is_late(REPEAT_PERIOD):
            # Publish again for clients that came late or lost a message.
            self.get_logger().info(f"waiting for {missing}", throttle_duration_sec=10)
            self._last_look = 0.0
            self.publish(everything=True)
            if self._window is not None:
                self._window.has_changed(note=f"waiting for {missing}")

    @property
    def speed(self) -> float:
        """Simulated seconds per real second; 0: as fast as possible."""
        return float(self.value("speed"))

    @property
    def is_paced(self) -> bool:
        """True if the world should keep up with real time: it runs, at a limited speed, and waits for nobody."""
        return not (self.paused or self._lockstep.is_used or self._pace.is_unlimited)

    def _answer(self, seconds: float) -> None:
        """Serves ROS and the page for up to `seconds`."""
        if self._window is not None:
            seconds = min(seconds, self._window.turn())
        self.times["answer"] += self._executor.spin(seconds)

    @property
    def topics(self) -> int:
        """Number of the robots' topics."""
        return len(self.team.feeds)

    def _stop(self) -> None:
        """Stops the page, the log and the action server, which no list of the node has."""
        if self._server is not None:
            self._server.stop()
        if self._standard is not None:
            self._standard.close()
        if self._log is not None:
            self._log.close()
        self._window, self._server, self._standard, self._log = None, None, None, None

    def close(self) -> None:
        """Stops the page, destroys the node and completes the log. The world stays valid."""
        self._stop()
        self._executor.close()
        self.destroy_node()
