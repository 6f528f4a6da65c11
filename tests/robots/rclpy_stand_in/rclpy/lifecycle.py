"""A node with a life cycle."""

from __future__ import annotations

from enum import Enum
from typing import Any, NamedTuple

from rclpy.graph import End, RCLError, world
from rclpy.node import Node


class TransitionCallbackReturn(Enum):
    SUCCESS = 97
    FAILURE = 98
    ERROR = 99


class LifecycleState(NamedTuple):
    label: str
    state_id: int


class LifecyclePublisher(End):
    is_activated = False

    def publish(self, message: Any) -> None:
        if self.is_activated:
            super().publish(message)

    def get_subscription_count(self) -> int:
        if self not in world.ends:
            raise RCLError("publisher is invalid")
        return sum(end.callback is not None and end.topic == self.topic for end in world.ends)


# Of each transition: from where, over which callback, to where.
_TRANSITIONS = {
    "configure": ("unconfigured", "inactive"),
    "activate": ("inactive", "active"),
    "deactivate": ("active", "inactive"),
    "cleanup": ("inactive", "unconfigured"),
}


class LifecycleNode(Node):
    def __init__(self, node_name: str) -> None:
        super().__init__(node_name)
        self.state = "unconfigured"
        self._managed_entities: set[LifecyclePublisher] = set()

    def create_lifecycle_publisher(self, msg_type: Any, topic: str, qos_profile: Any) -> Any:
        assert isinstance(msg_type, type)
        publisher = LifecyclePublisher(msg_type, topic, qos_profile)
        world.join(publisher)
        self._managed_entities.add(publisher)
        return publisher

    def destroy_lifecycle_publisher(self, publisher: LifecyclePublisher) -> bool:
        self._managed_entities.remove(publisher)
        world.leave(publisher)
        return True

    def trigger_configure(self) -> TransitionCallbackReturn:
        return self._change("configure")

    def trigger_activate(self) -> TransitionCallbackReturn:
        return self._change("activate")

    def trigger_deactivate(self) -> TransitionCallbackReturn:
        return self._change("deactivate")

    def trigger_cleanup(self) -> TransitionCallbackReturn:
        return self._change("cleanup")

    def trigger_shutdown(self) -> TransitionCallbackReturn:
        result = self._call("shutdown")
        self.state = "finalized"
        return result

    def _change(self, name: str) -> TransitionCallbackReturn:
        start, goal = _TRANSITIONS[name]
        if self.state != start:
            raise RCLError(f"no transition {name} from {self.state}")
        result = self._call(name)
        if result is TransitionCallbackReturn.SUCCESS:
            self.state = goal
        elif result is TransitionCallbackReturn.ERROR:
            recovers = self._call("error") is TransitionCallbackReturn.SUCCESS
            self.state = "unconfigured" if recovers else "finalized"
        return result

    def _call(self, name: str) -> TransitionCallbackReturn:
        try:
            result = getattr(self, f"on_{name}")(LifecycleState(self.state, 0))
        except Exception:  # noqa: BLE001 - rclpy does so, without a word
            return TransitionCallbackReturn.ERROR
        assert isinstance(result, TransitionCallbackReturn)
        return result

    def _notify(self, *, is_activated: bool) -> TransitionCallbackReturn:
        for publisher in self._managed_entities:
            publisher.is_activated = is_activated
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._notify(is_activated=True)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._notify(is_activated=False)

    def _pass(self, state: LifecycleState) -> TransitionCallbackReturn:
        return TransitionCallbackReturn.SUCCESS

    on_configure = on_cleanup = on_shutdown = on_error = _pass
