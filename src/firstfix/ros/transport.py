"""What a node needs from ROS 1, ROS 2 or plain DDS."""

from __future__ import annotations

from enum import Enum
from typing import Any, Protocol

from firstfix.ros.channels import Topic


class Severity(Enum):
    """Severity of a log line; the values are the methods of ROS 2's loggers."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class Transport(Protocol):
    """Makes messages, publishes them, and writes the log."""

    particles: Topic
    """The topic of particle clouds."""

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message of ``package/Type`` from all its fields."""

    def publish(self, topic: Topic, message: Any) -> None:
        """Send a message."""

    def subscriber_count(self, topic: Topic) -> int:
        """Count the subscribers of a topic."""

    def load_map(self, service: str, path: str) -> int:
        """Call ``LoadMap`` of a map server, and return its result; blocks for some seconds.

        Raises
        ------
        OSError
            If it does not answer.
        """

    def log(self, severity: Severity, text: str) -> None:
        """Write a line for people."""
