"""A service that answers once the robot is localized, so that a behaviour tree can wait for it."""

from __future__ import annotations

import threading
from typing import Any

from rclpy.lifecycle import LifecycleNode
from rclpy.task import Future

from firstfix.ros.ros2.types import find
from firstfix.ros.services import WAIT


class LocalizedService:
    """The service `wait_until_localized`; it exists as long as its node.

    A service of rclpy must not be destroyed while an answer is outstanding. Therefore it is not
    part of a transport, which ends with each cleanup.

    Parameters
    ----------
    owner : LifecycleNode
        The node.
    """

    def __init__(self, owner: LifecycleNode) -> None:
        self._changing = threading.Lock()
        self._is_localized = False
        self._waiting: list[Future[None]] = []
        owner.create_service(find("srv", WAIT.type_name), WAIT.name, self._answer)

    def update(self, *, is_localized: bool) -> None:
        """Answer all who wait, if the robot is localized; called by any thread."""
        with self._changing:
            self._is_localized = is_localized
            while is_localized and self._waiting:
                self._waiting.pop().set_result(None)

    async def _answer(self, _: Any, response: Any) -> Any:
        while (change := self._next_change()) is not None:
            await change
        return response

    def _next_change(self) -> Future[None] | None:
        with self._changing:
            if self._is_localized:
                return None
            self._waiting.append(Future())
            return self._waiting[-1]
