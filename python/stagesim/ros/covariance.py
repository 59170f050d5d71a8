# SPDX-License-Identifier: GPL-2.0-or-later
"""Covariances of odometry: how far an estimate may be off.

ROS takes a matrix of zeros for one that is not known, so none is published. What is known exactly has EXACT on the
diagonal, and what is not measured at all UNKNOWN.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

EXACT, UNKNOWN = 1e-9, 1e6
#: Where x, y and the heading are among x, y, z, roll, pitch, yaw.
PLANE = np.array([0, 1, 5])


def in_space(planar: Array) -> Array:
    """Matrices of x, y and heading as ROS has them: shape (n, 3, 3) becomes (n, 36), row by row.

    Nothing is measured of z, roll and pitch.
    """
    whole = np.zeros((len(planar), 6, 6))
    whole[:, PLANE[:, None], PLANE] = planar
    whole[:, PLANE, PLANE] += EXACT
    for axis in (2, 3, 4):
        whole[:, axis, axis] = UNKNOWN
    return whole.reshape(-1, 36)


class OdometryErrors:
    """How the errors of odometry have grown into errors of the estimated poses.

    Odometry adds a share of each motion forwards, to the left and turning, the property `odom_error`. To first order an
    estimate is off by J e, where e are the three shares and J is the derivative of the pose by them, which each motion
    changes. The covariance is J diag(e^2) J^T: each share counts as an independent error with its value as the standard
    deviation.

    Args:
        shares: forwards, to the left and turning, shape (n, 3).
    """

    def __init__(self, shares: Array) -> None:
        self._variances = shares**2
        self.jacobian = np.zeros((len(shares), 3, 3))
        self._before: Array | None = None

    def begin(self, poses: Array, jacobian: Array | None = None) -> None:
        """The world is at another time.

        Args:
            poses: the estimates there, x, y and heading, shape (n, 3).
            jacobian: what `jacobian` was at that time; None: nothing has been driven.
        """
        self.jacobian = np.zeros_like(self.jacobian) if jacobian is None else jacobian.copy()
        self._before = poses.copy()

    def move(self, poses: Array) -> None:
        """The estimates of the next step, shape (n, 3)."""
        if self._before is None:
            self.begin(poses)
            return
        motion = poses - self._before
        turn = np.remainder(motion[:, 2] + np.pi, 2 * np.pi) - np.pi
        c, s = np.cos(self._before[:, 2]), np.sin(self._before[:, 2])
        ahead, left = c * motion[:, 0] + s * motion[:, 1], c * motion[:, 1] - s * motion[:, 0]
        j = self.jacobian
        # An error of the heading turns the motion.
        j[:, 0] -= motion[:, 1, None] * j[:, 2]
        j[:, 1] += motion[:, 0, None] * j[:, 2]
        j[:, 0, 0] += c * ahead
        j[:, 0, 1] -= s * left
        j[:, 1, 0] += s * ahead
        j[:, 1, 1] += c * left
        j[:, 2, 2] += turn
        self._before[:] = poses

    def pose(self) -> Array:
        """Of the estimated poses, as ROS has it: shape (n, 36)."""
        found = np.einsum("nij,nj,nkj->nik", self.jacobian, self._variances, self.jacobian)
        return in_space((found + found.transpose(0, 2, 1)) / 2)  # symmetric to the last bit

    def twist(self, velocities: Array) -> Array:
        """Of the velocities (forwards, to the left, turning; shape (n, 3)), as ROS has it: shape (n, 36)."""
        return in_space((self._variances * velocities**2)[:, :, None] * np.eye(3))
