"""The errors of firstfix.

::

    FirstfixError
    └── InputError      what was given cannot be used: expected, received, remedy
        ├── MapError    ... in a map
        └── ScanError   ... in a scan or a log of scans
"""

from __future__ import annotations


class FirstfixError(Exception):
    """Root of every error that firstfix raises on purpose."""


class InputError(FirstfixError):
    """Input that cannot be used, told in one sentence.

    Parameters
    ----------
    expected : str
        What would have been right.
    received : str
        What came instead.
    remedy : str
        What the user can do.
    """

    def __init__(self, *, expected: str, received: str, remedy: str) -> None:
        self.expected = expected
        self.received = received
        self.remedy = remedy
        super().__init__(f"expected {expected}, received {received}; {remedy}")

    def __reduce__(self) -> tuple[object, ...]:
        # Worker processes of `bench` send errors home; keyword-only arguments need help to pickle.
        return (_rebuild, (type(self), self.expected, self.received, self.remedy))


class MapError(InputError):
    """A map that cannot be used."""


class ScanError(InputError):
    """A scan, or a log of scans, that cannot be used."""


def _rebuild(kind: type[InputError], expected: str, received: str, remedy: str) -> InputError:
    return kind(expected=expected, received=received, remedy=remedy)
