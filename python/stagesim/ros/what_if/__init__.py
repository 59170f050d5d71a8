# SPDX-License-Identifier: GPL-2.0-or-later
"""The ROS 2 node of a robot that decides by simulated futures: `python -m stagesim.ros.what_if`.

The robot may be a real one, or one in a simulation. docs/ros_what_if.md lists all topics and parameters.
"""
