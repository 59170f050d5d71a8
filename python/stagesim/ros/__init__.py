# SPDX-License-Identifier: GPL-2.0-or-later
"""The robots of a world as ROS 2 robots: `python -m stagesim.ros WORLD`.

It needs rclpy and ROS 2's standard messages: from a ROS 2 installation, or by `pip install "stagesim[ros]"`.
Nothing here is imported by `import stagesim`. docs/ros.md has all topics, services and parameters.
"""
