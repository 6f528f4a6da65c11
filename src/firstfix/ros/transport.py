"""What a node needs of the world: ROS 1, ROS 2 and plain DDS each are one."""

from __future__ import annotations

from enum import Enum
from typing import Any, Protocol

from firstfix.ros.channels import Topic


class Severity(Enum):
    """How grave a line of the log is; the values are the methods of ROS 2's loggers."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class Transport(Protocol):
    """Makes messages, publishes them, and writes the log."""

    particles: Topic
    """How clouds of particles are published here."""

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message of ``package/Type`` from all its fields."""

    def publish(self, topic: Topic, message: Any) -> None:
        """Send a message."""

    def listeners(self, topic: Topic) -> int:
        """Count those who listen."""

    def log(self, gravity: Severity, text: str) -> None:
        """Write a line for people."""
