# SPDX-License-Identifier: GPL-2.0-or-later
"""Publishers and subscriptions of robots, which stay while other robots come and go."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Callable

from .topics import make_publisher

if TYPE_CHECKING:
    from .node import StageNode


class _Receiver:
    """A subscription whose callback can be replaced.

    Attributes:
        subscription: the subscription.
        callback: called with each message.
    """

    def __init__(self, node: StageNode, message: type, topic: str, callback: Callable[[Any], None]) -> None:
        self.callback = callback
        self.subscription = node.create_subscription(message, topic, lambda received: self.callback(received), 10)


class Endpoints:
    """Makes publishers and subscriptions, or returns those of earlier robots with the same type and topic.

    Args:
        node: the node.
    """

    def __init__(self, node: StageNode) -> None:
        self._node = node
        self._publishers: dict[tuple[str, type], Any] = {}
        self._receivers: dict[tuple[str, type], _Receiver] = {}
        self._used: set[tuple[str, type]] = set()

    def publisher(self, message: type, topic: str, qos: Any, fixed: bool = False) -> Any:
        """A publisher; a new one has the quality of service `qos`, which parameters can change unless it is `fixed`.

        Raises:
            ValueError: see make_publisher().
        """
        key = topic, message
        self._used.add(key)
        if key not in self._publishers:
            make = self._node.create_publisher if fixed else partial(make_publisher, self._node)
            self._publishers[key] = make(message, topic, qos)
        return self._publishers[key]

    def subscribe(self, message: type, topic: str, callback: Callable[[Any], None]) -> None:
        """Makes a subscription, or replaces the callback of an earlier one."""
        key = topic, message
        self._used.add(key)
        if key in self._receivers:
            self._receivers[key].callback = callback
        else:
            self._receivers[key] = _Receiver(self._node, message, topic, callback)

    def remove_unused(self) -> None:
        """Destroys what nobody has asked for since the last call."""
        for key in self._publishers.keys() - self._used:
            self._node.destroy_publisher(self._publishers.pop(key))
        for key in self._receivers.keys() - self._used:
            self._node.destroy_subscription(self._receivers.pop(key).subscription)
        self._used.clear()
