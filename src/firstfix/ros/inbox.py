"""The queue between the callbacks of a transport and the worker thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Hashable
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """A queue that keeps everything but scans, of which it keeps the newest of each sensor.

    Callbacks never wait for the worker.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._kept: deque[Item] = deque()
        self._scans: dict[Hashable, Item] = {}
        self._is_closed = False

    @property
    def is_closed(self) -> bool:
        """True after `close`."""
        return self._is_closed

    def put(self, item: Item) -> None:
        """Queue an item that must not be lost."""
        with self._changed:
            self._kept.append(item)
            self._changed.notify()

    def put_scan(self, item: Item, sensor: Hashable = None) -> None:
        """Queue a scan in place of one of its sensor that the worker has not taken yet."""
        with self._changed:
            self._scans.pop(sensor, None)
            self._scans[sensor] = item
            self._changed.notify()

    def take(self, timeout_s: float) -> list[Item]:
        """Wait for items, and take all of them.

        Parameters
        ----------
        timeout_s : float
            Longest time to wait, s.

        Returns
        -------
        list
            In the order of arrival, the scans last; empty after the timeout and after `close`.
        """
        with self._changed:
            self._changed.wait_for(self._has_items, timeout_s)
            if self._is_closed:
                return []
            items = [*self._kept, *self._scans.values()]
            self._kept.clear()
            self._scans.clear()
            return items

    def close(self) -> None:
        """End the wait of the worker; from now on `take` returns nothing."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def _has_items(self) -> bool:
        return self._is_closed or bool(self._kept) or bool(self._scans)
