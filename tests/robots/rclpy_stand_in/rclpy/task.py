"""A future that a callback of a service may await."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any


class Future:
    def __init__(self) -> None:
        self._done = False
        self._result: Any = None

    def __await__(self) -> Generator[None, None, Any]:
        while not self._done:
            yield
        return self._result

    def add_done_callback(self, callback: Any) -> None:
        assert self._done  # a client of the stand-in calls at once
        callback(self)

    def result(self) -> Any:
        return self._result

    def done(self) -> bool:
        return self._done

    def set_result(self, result: Any) -> None:
        self._result, self._done = result, True
