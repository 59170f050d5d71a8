# SPDX-License-Identifier: GPL-2.0-or-later
"""The publishers, subscriptions, services and parameters that a node has got since a moment."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node

from .parameters import undeclare


class Belongings:
    """Remembers what a node has, so that release() can destroy what it has got afterwards."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._parts, self._parameters = self._now()

    def _now(self) -> tuple[set[Any], set[str]]:
        node = self._node
        return {*node.publishers, *node.subscriptions, *node.services}, set(node.get_parameters_by_prefix(""))

    def release(self) -> None:
        """Destroys what the node has got since this object was made."""
        node = self._node
        parts, parameters = self._now()
        for publisher in parts.intersection(node.publishers) - self._parts:
            node.destroy_publisher(publisher)
        for subscription in parts.intersection(node.subscriptions) - self._parts:
            node.destroy_subscription(subscription)
        for service in parts.intersection(node.services) - self._parts:
            node.destroy_service(service)
        for name in parameters - self._parameters:
            undeclare(node, name)
