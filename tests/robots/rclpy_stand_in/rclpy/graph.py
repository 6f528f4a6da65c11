"""What is not in rclpy: the other side, for tests."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from rclpy.exceptions import InvalidTopicNameException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

_NAME = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*")


class RCLError(RuntimeError):
    """As rclpy's."""


@dataclass
class Arguments:
    """Of a command line."""

    others: list[str] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)
    remappings: dict[str, str] = field(default_factory=dict)


@dataclass(eq=False)
class End:
    """An end of a topic, of the node or of a test."""

    kind: Any
    topic: str
    quality: QoSProfile
    callback: Callable[[Any], None] | None = None
    sent: list[Any] = field(default_factory=list)

    def publish(self, message: Any) -> None:
        """Deliver to all subscriptions that match."""
        if not world.is_ok or self not in world.ends:
            raise RCLError("publisher's context is invalid")
        if not isinstance(message, self.kind):
            raise TypeError(f"Expected {self.kind}, got {type(message)}")
        self.sent.append(message)
        for end in [*world.ends]:
            if end.callback is not None and matches(self, end):
                end.callback(message)


@dataclass
class World:
    """All that is connected."""

    is_ok: bool = False
    arguments: Arguments = field(default_factory=Arguments)
    ends: list[End] = field(default_factory=list)
    services: dict[str, tuple[Any, Callable[[Any, Any], Any]]] = field(default_factory=dict)
    timers: list[Callable[[], None]] = field(default_factory=list)
    log: list[tuple[str, str]] = field(default_factory=list)
    during_spin: Callable[[Any], None] = lambda _: None

    def reset(self, arguments: Arguments) -> None:
        """Begin."""
        self.is_ok, self.arguments = True, arguments
        self.ends, self.services, self.timers, self.log = [], {}, [], []

    def join(self, end: End) -> End:
        """Connect an end; a late subscription gets what is kept for it."""
        name = self.arguments.remappings.get(end.topic, end.topic)
        if not _NAME.fullmatch(name):
            raise InvalidTopicNameException(f"Invalid topic name:\n  '{name}'\n   ^")
        end.topic = name if name.startswith("/") else f"/{name}"
        self.ends.append(end)
        is_late = end.quality.durability == DurabilityPolicy.TRANSIENT_LOCAL
        if end.callback is not None and is_late:
            for other in [e for e in self.ends if e.callback is None and matches(e, end)]:
                for message in other.sent[-other.quality.depth :]:
                    end.callback(message)
        return end

    def leave(self, end: End) -> None:
        """Disconnect an end."""
        self.ends.remove(end)

    def advertise(self, kind: Any, topic: str, quality: QoSProfile) -> End:
        """Return a publisher of a test."""
        return self.join(End(kind, topic, quality))

    def listen(
        self, kind: Any, topic: str, quality: QoSProfile, receive: Callable[[Any], None]
    ) -> None:
        """Call a function with what the node publishes."""
        self.join(End(kind, topic, quality, receive))

    def ask(self, service: str, request: Any = None) -> Any:
        """Call a service; return its response, or the coroutine that will return it."""
        kind, callback = self.services[service]
        response = callback(request or kind.Request(), kind.Response())
        assert inspect.iscoroutine(response) or isinstance(response, kind.Response)
        return response

    def lines(self, severity: str) -> list[str]:
        """Return what was logged with a severity."""
        return [text for how, text in self.log if how == severity]


def matches(publisher: End, subscription: End) -> bool:
    """Tell whether the middleware would connect two ends."""
    offered, wanted = publisher.quality, subscription.quality
    is_reliable = offered.reliability == ReliabilityPolicy.RELIABLE
    is_kept = offered.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return (
        publisher.callback is None
        and publisher.topic == subscription.topic
        and publisher.kind is subscription.kind
        and (is_reliable or wanted.reliability == ReliabilityPolicy.BEST_EFFORT)
        and (is_kept or wanted.durability == DurabilityPolicy.VOLATILE)
    )


world = World()
