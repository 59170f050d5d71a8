# SPDX-License-Identifier: GPL-2.0-or-later
"""The ROS 2 node, which publishes the robots of a world: `python -m stagesim.ros WORLD`.

It needs rclpy and ROS 2's standard messages, from a ROS 2 installation or by `pip install "stagesim[ros]"`.
`import stagesim` does not import this package. docs/ros_reference.md lists all topics, services and parameters.
"""
