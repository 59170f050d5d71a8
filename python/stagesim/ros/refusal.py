# SPDX-License-Identifier: GPL-2.0-or-later
"""A service's request that can't be met."""

from __future__ import annotations


class Refusal(Exception):
    """Carries the result code of the response.

    Args:
        code: the code, of the service or of simulation_interfaces/Result.
        reason: the error message.
    """

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code
