# SPDX-License-Identifier: GPL-2.0-or-later
"""Decisions as messages: a table of scores, and futures in colours."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64MultiArray, Header, MultiArrayDimension
from visualization_msgs.msg import Marker, MarkerArray

from ...belief import Decision
from ..covariance import Array, in_space
from ..messages import planar
from .plane import Moving

#: Columns of the table of scores.
COLUMNS = ("ahead", "left", "turn", "score", "risk", "risk_low", "risk_high", "samples", "chosen")
#: A future has about so many points.
_POINTS = 16
#: Widths of lines, metres.
_THIN, _THICK = 0.015, 0.05


def scores(plans: Array, decision: Decision) -> Float64MultiArray:
    """A row for each plan, with the numbers that COLUMNS names."""
    chosen = np.arange(len(plans)) == decision.best
    table = np.column_stack([plans[:, 0], decision.mean, decision.risk, decision.risk_interval,
                             np.isfinite(decision.scores).sum(1), chosen])
    message = Float64MultiArray(data=table.ravel().tolist())
    message.layout.dim = [MultiArrayDimension(label="plan", size=len(table), stride=table.size),
                          MultiArrayDimension(label=",".join(COLUMNS), size=len(COLUMNS), stride=len(COLUMNS))]
    return message


def futures(header: Header, decision: Decision) -> MarkerArray:
    """The first sample of each plan, from green without a risk to red; the chosen one is thick and on top."""
    message = MarkerArray(markers=[Marker(header=header, action=Marker.DELETEALL)])
    for plan, risk in enumerate(decision.risk.tolist()):
        poses = decision.future(plan)[:, 0]
        if len(poses) < 2:
            continue
        chosen = plan == decision.best
        marker = Marker(header=header, ns="futures", id=plan, type=Marker.LINE_STRIP, action=Marker.ADD)
        marker.pose.orientation.w = 1.0
        marker.scale.x = _THICK if chosen else _THIN
        marker.color.r, marker.color.g, marker.color.a = min(1.0, 2 * risk), min(1.0, 2 - 2 * risk), 1.0
        height = 0.02 if chosen else 0.0
        some = poses[np.unique(np.linspace(0, len(poses) - 1, _POINTS).astype(int)), :2].tolist()
        marker.points = [Point(x=x, y=y, z=height) for x, y in some]
        message.markers.append(marker)
    return message


def odometry(header: Header, child: str, robot: Moving) -> Odometry:
    """The believed place and velocity of the robot, in the map."""
    message = Odometry(header=header, child_frame_id=child)
    place, turned = message.pose.pose.position, message.pose.pose.orientation
    place.x, place.y, place.z, turned.x, turned.y, turned.z, turned.w = planar(robot.pose[None])[0].tolist()
    message.pose.covariance = in_space(robot.pose_covariance[None])[0]
    twist = message.twist.twist
    twist.linear.x, twist.linear.y, twist.angular.z = robot.velocity.tolist()
    message.twist.covariance = in_space(robot.velocity_covariance[None])[0]
    return message
