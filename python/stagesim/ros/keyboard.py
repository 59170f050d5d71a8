# SPDX-License-Identifier: GPL-2.0-or-later
"""Drives a robot with the keyboard: `python -m stagesim.ros.keyboard [ROBOT]`.

It is for users without a ROS 2 installation and has the keys of ROS 2's teleop_twist_keyboard.
"""

from __future__ import annotations

import argparse
import select
import sys
import termios
import tty

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from .names import joined

# Factors of the speeds forwards and turning left.
KEYS = {"u": (1, 1), "i": (1, 0), "o": (1, -1), "j": (0, 1), "k": (0, 0), "l": (0, -1),
        "m": (-1, -1), ",": (-1, 0), ".": (-1, 1)}
PERIOD = 0.05  # seconds between commands; must be below the timeout of the node's watchdog


class Keyboard(Node):
    """Publishes the command of the last key repeatedly."""

    def __init__(self, robot: str, stamped: bool, speed: float, turn: float) -> None:
        super().__init__("keyboard")
        self._stamped, self._speed, self._turn = stamped, speed, turn
        self._twist = Twist()
        self._publisher = self.create_publisher(TwistStamped if stamped else Twist,
                                                joined(robot, "cmd_vel"), 10)

    def press(self, key: str) -> bool:
        """Handles a key; returns False if it ends the program: q or Ctrl-C."""
        if key in ("q", "\x03", ""):
            self._twist = Twist()
            return False
        ahead, left = KEYS.get(key, (0, 0))
        self._twist.linear.x, self._twist.angular.z = ahead * self._speed, left * self._turn
        return True

    def repeat(self) -> None:
        """Publishes the command again."""
        self._publisher.publish(TwistStamped(twist=self._twist) if self._stamped else self._twist)


def main() -> None:
    """Handles keys until q is pressed."""
    parser = argparse.ArgumentParser(prog="python -m stagesim.ros.keyboard",
                                     description="Drives a robot. i and , drive ahead and back, j and l turn, u o m . "
                                                 "do both; other keys stop the robot, q quits.")
    parser.add_argument("robot", nargs="?", default="",
                        help="prefix of the robot's topics (default: none, as for a single robot)")
    parser.add_argument("--stamped", action="store_true", help="send cmd_vel as TwistStamped")
    parser.add_argument("--speed", type=float, default=0.4, help="metres per second (default 0.4)")
    parser.add_argument("--turn", type=float, default=0.8, help="radians per second (default 0.8)")
    chosen = parser.parse_args(remove_ros_args(sys.argv)[1:])
    if not sys.stdin.isatty():
        sys.exit("stagesim.ros.keyboard: found no terminal to read keys from")
    rclpy.init(args=sys.argv)
    keyboard = Keyboard(chosen.robot, chosen.stamped, chosen.speed, chosen.turn)
    before = termios.tcgetattr(sys.stdin)
    print(parser.description)
    try:
        tty.setraw(sys.stdin)
        going = True
        while going and rclpy.ok():
            if select.select([sys.stdin], [], [], PERIOD)[0]:
                going = keyboard.press(sys.stdin.read(1))
            keyboard.repeat()
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        keyboard.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
