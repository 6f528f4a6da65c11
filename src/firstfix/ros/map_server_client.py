"""Asks a map server to load the map of each floor, in a thread: it may be away, or slow."""

from __future__ import annotations

import threading
from collections.abc import Callable

from firstfix.ros.services import LoadResult

Load = Callable[[str], int]
"""Calls the service with a path, and returns its result.

Raises
------
OSError
    If the map server does not answer.
"""

# A map server that is away is asked again after this time, s.
_AGAIN_S = 2.0


class MapServerClient:
    """Asks for one map after the other; a newer one replaces one that waits.

    Parameters
    ----------
    load : Load
        Calls the service; blocks.
    warn : callable
        Receives what went wrong, as text, in the thread of this client.
    again_s : float, optional
        Pause after a failure, s.
    """

    def __init__(self, load: Load, warn: Callable[[str], None], again_s: float = _AGAIN_S) -> None:
        self._load = load
        self._warn = warn
        self._again_s = again_s
        self._changed = threading.Condition()
        self._wanted: str | None = None
        self._is_closed = False
        self._thread = threading.Thread(target=self._run, name="map-server", daemon=True)
        self._thread.start()

    def ask(self, path: str) -> None:
        """Ask for a map; returns at once."""
        with self._changed:
            self._wanted = path
            self._changed.notify()

    def close(self) -> None:
        """Ask for nothing more; a call that has begun ends by itself."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def _run(self) -> None:
        while (path := self._next()) is not None:
            problem = self._problem_with(path)
            if problem is None:
                with self._changed:
                    self._wanted = None if self._wanted == path else self._wanted
                continue
            self._warn(f"the map server has not loaded {path}: {problem}; trying again")
            with self._changed:
                self._changed.wait(self._again_s)

    def _next(self) -> str | None:
        """Wait for a map that is wanted; None at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._is_closed or self._wanted is not None)
            return None if self._is_closed else self._wanted

    def _problem_with(self, path: str) -> str | None:
        try:
            result = self._load(path)
        except OSError as error:
            return f"{error}"
        if result == LoadResult.SUCCESS:
            return None
        names = {int(each): each.name.lower().replace("_", " ") for each in LoadResult}
        return names.get(result, f"result {result}")
