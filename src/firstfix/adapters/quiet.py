"""A transport for a robot that is not on any network."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from firstfix.adapters.topics import PARTICLES, Topic
from firstfix.adapters.transport import Gravity


class Quiet:
    """Sends nothing; what there is to say is seen by the watchers of the node.

    Parameters
    ----------
    log : callable
        Takes the lines of the log that are more than information.
    """

    particles = PARTICLES

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build what has the fields of a message."""
        del type_name
        return SimpleNamespace(**fields)

    def publish(self, topic: Topic, message: Any) -> None:
        """Send nothing."""

    def listeners(self, topic: Topic) -> int:
        """Return 0."""
        del topic
        return 0

    def log(self, gravity: Gravity, text: str) -> None:
        """Pass on what is more than information."""
        if gravity is not Gravity.INFO:
            self._log(text)
