# SPDX-License-Identifier: GPL-2.0-or-later
"""Covariances of odometry.

In ROS, a matrix of zeros means that the covariance is unknown, so none is published. Exact values have EXACT on the
diagonal, and values that are not measured have UNKNOWN.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._core import EXACT_COVARIANCE, UNKNOWN_COVARIANCE

Array = npt.NDArray[np.float64]

#: Variances of exact values and of values that are not measured, as in logs.
EXACT, UNKNOWN = EXACT_COVARIANCE, UNKNOWN_COVARIANCE
#: Indices of x, y and the heading in x, y, z, roll, pitch, yaw.
PLANE = np.array([0, 1, 5])


def in_space(planar: Array) -> Array:
    """Converts covariances of x, y and heading, shape (n, 3, 3), to ROS's 6 x 6 matrices, shape (n, 36).

    They are stored row by row. z, roll and pitch are UNKNOWN.
    """
    whole = np.zeros((len(planar), 6, 6))
    whole[:, PLANE[:, None], PLANE] = planar
    whole[:, PLANE, PLANE] += EXACT
    for axis in (2, 3, 4):
        whole[:, axis, axis] = UNKNOWN
    return whole.reshape(-1, 36)


class OdometryErrors:
    """Propagates the errors of odometry to the covariances of the estimated poses.

    Odometry scales each motion forwards, to the left and turning by 1 + e, where e is the property `odom_error`. To
    first order the error of an estimated pose is J e, where J is the Jacobian of the pose with respect to e; each
    motion updates it. The covariance is J diag(e^2) J^T: the components of e count as independent errors with
    themselves as standard deviations. The covariances of the random errors, `odom_noise`, come from the simulation.

    Args:
        shares: e forwards, to the left and turning, as fractions of the motion: shape (n, 3).
    """

    def __init__(self, shares: Array) -> None:
        self._variances = shares**2
        self.jacobian = np.zeros((len(shares), 3, 3))
        self._before: Array | None = None

    def begin(self, poses: Array, jacobian: Array | None = None) -> None:
        """Starts anew after a reset or a restore.

        Args:
            poses: the estimated poses x, y and heading, shape (n, 3).
            jacobian: the value of `jacobian` at the restored time; None: zeros, as before any motion.
        """
        self.jacobian = np.zeros_like(self.jacobian) if jacobian is None else jacobian.copy()
        self._before = poses.copy()

    def take_over(self, other: OdometryErrors, rows: Array, others: Array) -> None:
        """Continues rows `others` of other errors in the rows `rows`."""
        self.jacobian[rows] = other.jacobian[others]
        if self._before is not None and other._before is not None:
            self._before[rows] = other._before[others]

    def move(self, poses: Array) -> None:
        """Adds a step, after which the estimated poses are `poses`, shape (n, 3)."""
        if self._before is None:
            self.begin(poses)
            return
        motion = poses - self._before
        turn = np.remainder(motion[:, 2] + np.pi, 2 * np.pi) - np.pi
        c, s = np.cos(self._before[:, 2]), np.sin(self._before[:, 2])
        ahead, left = c * motion[:, 0] + s * motion[:, 1], c * motion[:, 1] - s * motion[:, 0]
        j = self.jacobian
        # An error of the heading rotates the motion.
        j[:, 0] -= motion[:, 1, None] * j[:, 2]
        j[:, 1] += motion[:, 0, None] * j[:, 2]
        j[:, 0, 0] += c * ahead
        j[:, 0, 1] -= s * left
        j[:, 1, 0] += s * ahead
        j[:, 1, 1] += c * left
        j[:, 2, 2] += turn
        self._before[:] = poses

    def pose(self, random: Array | float = 0) -> Array:
        """Covariances of the estimated poses in ROS's format: shape (n, 36).

        Args:
            random: those of random errors, shape (n, 3, 3), which are added.
        """
        found = np.einsum("nij,nj,nkj->nik", self.jacobian, self._variances, self.jacobian)
        return in_space((found + found.transpose(0, 2, 1)) / 2 + random)  # symmetric to the last bit

    def twist(self, velocities: Array, random: Array | float = 0) -> Array:
        """Covariances of velocities (forwards, to the left, turning; shape (n, 3)) in ROS's format: (n, 36).

        Args:
            random: those of random errors, shape (n, 3, 3), which are added.
        """
        return in_space((self._variances * velocities**2)[:, :, None] * np.eye(3) + random)
