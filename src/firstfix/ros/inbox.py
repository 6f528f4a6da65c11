"""Between the callbacks of a transport and the one thread that thinks."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """What callbacks hand in, until a worker takes it: the newest scan wins, nothing else is lost.

    Callbacks never wait for the worker.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._kept: deque[Item] = deque()
        self._scan: Item | None = None
        self._is_closed = False

    @property
    def is_closed(self) -> bool:
        """True after `close`."""
        return self._is_closed

    def put(self, item: Item) -> None:
        """Hand in something that must not be lost."""
        with self._changed:
            self._kept.append(item)
            self._changed.notify()

    def put_scan(self, item: Item) -> None:
        """Hand in a scan; one that the worker has not taken yet is given up for it."""
        with self._changed:
            self._scan = item
            self._changed.notify()

    def take(self, timeout_s: float) -> list[Item]:
        """Wait until there is something, and take all.

        Parameters
        ----------
        timeout_s : float
            Longest time to wait, s.

        Returns
        -------
        list
            In the order in which it came, the scan last; empty if nothing came, or after `close`.
        """
        with self._changed:
            self._changed.wait_for(self._has_news, timeout_s)
            if self._is_closed:
                return []
            items = [*self._kept]
            if self._scan is not None:
                items.append(self._scan)
            self._kept.clear()
            self._scan = None
            return items

    def close(self) -> None:
        """Let the worker go home."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def _has_news(self) -> bool:
        return self._is_closed or bool(self._kept) or self._scan is not None
