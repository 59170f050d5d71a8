# SPDX-License-Identifier: GPL-2.0-or-later
"""Generates the ROS package tf2_msgs with the message TFMessage, which /tf and /tf_static need.

    python -m stagesim.ros.make_tf2_msgs

`python -m stagesim.ros.make_messages` makes this package and others.
"""

from __future__ import annotations

import sys

from .make_messages import main

if __name__ == "__main__":
    sys.exit(main(["tf2_msgs"]))
