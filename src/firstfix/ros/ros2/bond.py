"""The bond of a lifecycle node: heartbeats by which Nav2's lifecycle manager notices its death."""

from __future__ import annotations

import uuid
from typing import Any

import rclpy
from rclpy.lifecycle import LifecycleNode

BOND = "bond/Status"
# As in Nav2's own nodes.
_PERIOD_S = 0.1
_DEPTH = 10


class Bond:
    """Publishes heartbeats on ``bond`` until it is closed.

    The manager sends its own heartbeats on the same topic. They are not needed here: a node of Nav2
    does nothing when the manager dies.

    Parameters
    ----------
    owner : LifecycleNode
        The node.
    kind : type
        ``bond/Status``.
    timeout_s : float
        Silence after which the manager treats the node as dead, s.
    """

    def __init__(self, owner: LifecycleNode, kind: Any, timeout_s: float) -> None:
        self._owner = owner
        self._kind = kind
        self._timeout_s = timeout_s
        self._instance = str(uuid.uuid4())
        self._publisher = owner.create_publisher(kind, "bond", _DEPTH)
        self._timer = owner.create_timer(_PERIOD_S, self._beat)
        self._beat()

    def close(self) -> None:
        """Report the end of the bond, and stop."""
        self._owner.destroy_timer(self._timer)
        if rclpy.ok():
            self._send(is_active=False)
        self._owner.destroy_publisher(self._publisher)

    def _beat(self) -> None:
        if rclpy.ok():
            self._send(is_active=True)

    def _send(self, *, is_active: bool) -> None:
        message = self._kind(
            id=self._owner.get_name(),
            instance_id=self._instance,
            active=is_active,
            heartbeat_timeout=self._timeout_s,
            heartbeat_period=_PERIOD_S,
        )
        message.header.stamp = self._owner.get_clock().now().to_msg()
        self._publisher.publish(message)
