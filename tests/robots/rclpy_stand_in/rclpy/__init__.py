"""A stand-in for rclpy, which can be had neither from PyPI nor from Debian.

It proves only that the adapter calls what rclpy documents, in an order that rclpy allows, with
messages that rosidl's classes take. It is not ROS: no middleware, no executor, no process but this
one. Where rclpy is known to be strict (severity of a log line, types and ranges of parameters,
quality of service, use after destruction), this is strict, too.

Tests look into `graph` to talk to the node.
"""

from __future__ import annotations

from typing import Any

from rclpy import graph, utilities
from rclpy.executors import ExternalShutdownException


def init(*, args: list[str] | None = None) -> None:
    assert not graph.world.is_ok, "rclpy.init() was called twice"
    graph.world.reset(utilities.parsed(args or []))


def ok() -> bool:
    return graph.world.is_ok


def spin(node: Any) -> None:
    graph.world.during_spin(node)
    graph.world.is_ok = False
    raise ExternalShutdownException


def try_shutdown() -> None:
    graph.world.is_ok = False
