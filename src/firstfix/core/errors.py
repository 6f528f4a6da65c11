"""The errors of firstfix.

::

    FirstfixError
    └── InputError      the input cannot be used
        ├── MapError    ... in a map
        └── ScanError   ... in a scan or a log of scans
"""

from __future__ import annotations


class FirstfixError(Exception):
    """Base class of all errors that firstfix raises for bad input.

    Examples
    --------
    >>> try:
    ...     ff.load_map("missing.yaml")
    ... except ff.FirstfixError as error:
    ...     print(type(error).__name__)
    MapError
    """


class InputError(FirstfixError):
    """Input that cannot be used.

    Parameters
    ----------
    message : str, optional
        What is wrong and what to do, in plain sentences. Without it the text is made of the other
        three, which suit malformed data.
    expected : str
        What is required.
    received : str
        What was passed.
    remedy : str
        What the user can do.

    Examples
    --------
    >>> ff.ScanMatcher(grid, method="quick")
    Traceback (most recent call last):
    ...
    firstfix.core.errors.InputError: expected method as one of fast, paper, paper-basic, ...
    """

    def __init__(
        self, message: str = "", *, expected: str = "", received: str = "", remedy: str = ""
    ) -> None:
        self.expected = expected
        self.received = received
        self.remedy = remedy
        super().__init__(message or f"expected {expected}, received {received}; {remedy}")

    def __reduce__(self) -> tuple[object, ...]:
        # Worker processes send errors to their parent; keyword-only arguments do not pickle.
        return _rebuild, (type(self), str(self), self.expected, self.received, self.remedy)


class MapError(InputError):
    """A map that cannot be used.

    Examples
    --------
    >>> ff.OccupancyGrid(np.zeros((0, 3), np.int8), resolution=0.05)
    Traceback (most recent call last):
    ...
    firstfix.core.errors.MapError: expected a map of at least one row and one column, ...
    """


class ScanError(InputError):
    """A scan or a log that cannot be used.

    Examples
    --------
    >>> ff.LaserScan([1.0, 2.0], angle_min=0.0, angle_increment=0.1, range_min=5.0, range_max=1.0)
    Traceback (most recent call last):
    ...
    firstfix.core.errors.ScanError: expected a range_max above range_min, ...
    """


def _rebuild(
    kind: type[InputError], message: str, expected: str, received: str, remedy: str
) -> InputError:
    return kind(message, expected=expected, received=received, remedy=remedy)
