# SPDX-License-Identifier: GPL-2.0-or-later
"""A ROS domain for one run of tests, which no other run on this machine uses at the same time."""

from __future__ import annotations

import os
import socket
from pathlib import Path

#: Domains whose ports lie below those that systems give to clients, so that nothing else takes them.
DOMAINS = range(1, 101)


def take_domain() -> socket.socket:
    """Sets the environment so that this process and its children are alone in a domain of this machine.

    A socket named after the domain's number reserves it. The name is abstract (not in the file system), so the kernel
    frees it when this process ends in any way.

    Returns:
        The socket, to be kept as long as the domain is used.

    Raises:
        RuntimeError: all domains are taken.
    """
    first = os.getpid()
    for i in range(len(DOMAINS)):
        domain = DOMAINS[(first + i) % len(DOMAINS)]
        guard = _guard(domain)
        if guard is None:
            continue
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SYSTEM_DEFAULT"  # as the profile says
        os.environ["FASTDDS_DEFAULT_PROFILES_FILE"] = str(Path(__file__).with_name("local.xml"))
        return guard
    raise RuntimeError(f"found no free ROS domain of {DOMAINS[0]} to {DOMAINS[-1]}, expected one")


def _guard(domain: int) -> socket.socket | None:
    """The socket that reserves the domain; None if another process has it, or nodes are in it."""
    guard = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        guard.bind(f"\0stage-tests-ros-domain-{domain}")
        # The ports of DDS for discovery, by several receivers and by the first participant.
        for port in (7400 + 250 * domain, 7410 + 250 * domain):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind(("", port))
    except OSError:
        guard.close()
        return None
    return guard
