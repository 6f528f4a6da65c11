"""A log as the inputs that a robot would have sent."""

from __future__ import annotations

import heapq
from collections.abc import Iterator

from firstfix.core.odometry import Odometry
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import Input
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output


def replay(inputs: Iterator[Input], localizer: Localizer) -> Iterator[tuple[Input, list[Output]]]:
    """Hand inputs to a localizer, one after the other.

    Parameters
    ----------
    inputs : iterator of Input
        In the order of their stamps.
    localizer : Localizer
        Whose state goes on from where it is.

    Yields
    ------
    tuple of Input and list of Output
        Each input with what it led to.
    """
    for given in inputs:
        yield given, localizer.handle(given)


def recorded_inputs(recording: Recording) -> Iterator[Input]:
    """Return the scans and the odometry of a log in the order of their stamps.

    Parameters
    ----------
    recording : Recording
        The log. Without odometry there are scans only.

    Yields
    ------
    LaserScan or Odometry
        At one stamp the odometry comes first.
    """
    scans: Iterator[LaserScan | Odometry] = iter(recording.scans)
    yield from heapq.merge(_odometry(recording), scans, key=_stamp)


def _odometry(recording: Recording) -> Iterator[LaserScan | Odometry]:
    if recording.odometry is None:
        return
    for stamp, pose in zip(
        recording.odometry.stamps.tolist(), recording.odometry.poses, strict=True
    ):
        yield Odometry(stamp, SE2.from_array(pose))


def _stamp(given: LaserScan | Odometry) -> float:
    return given.stamp
