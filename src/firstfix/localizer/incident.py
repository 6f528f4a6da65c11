"""The last seconds of a localizer, and the recorder that keeps them.

A localizer has no clock and the same inputs give the same outputs. So its state at one time and the
inputs since are enough to repeat its outputs to the last bit
([0029](../../docs/decisions/0029-incidents.md)).
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.localizer.checkpoint import known_parts, write_state
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import Input, NewMap, PoseHint
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Output, Status
from firstfix.localizer.state_codec import Encoder
from firstfix.localizer.states import State

# The state is written so many times in the seconds that are kept: they are exceeded by one part.
_PARTS = 3
# Limits of what is kept, whatever the rates of the sensors.
_MOST_INPUTS = 20_000
_MOST_BYTES = 64 * 2**20
_SMALL_BYTES = 1000  # of an input without ranges, roughly


class Cause(Enum):
    """Why an incident is saved."""

    LOST_POSE = "lost pose"
    REVOKED_POSE = "revoked pose"
    REFUSED_HINT = "refused hint"
    REQUESTED = "requested"


@dataclass(frozen=True, eq=False, slots=True)
class WrittenState:
    """The state of a localizer as plain values.

    Parameters
    ----------
    value : object
        Of `write_state`.
    nodes : list
        Of its encoder.
    arrays : bytes
        Of its encoder.
    """

    value: Any
    nodes: list[Any]
    arrays: bytes


@dataclass(frozen=True, eq=False, slots=True)
class Incident:
    """The last seconds of a localizer.

    Parameters
    ----------
    cause : Cause
        Why it is kept.
    reason : str
        In words, for a person.
    stamp : float
        Time of the last input, s.
    config : LocalizerConfig
        Settings of the localizer.
    map : NewMap
        The map in use.
    start : WrittenState
        The state before the first input.
    inputs : tuple of Input
        In the order in which they were handled; no map among them.
    outputs : tuple of tuple of Output
        Of each input.
    """

    cause: Cause
    reason: str
    stamp: float
    config: LocalizerConfig
    map: NewMap
    start: WrittenState
    inputs: tuple[Input, ...]
    outputs: tuple[tuple[Output, ...], ...]


@dataclass(eq=False, slots=True)
class _Part:
    """A state, and what followed."""

    start: WrittenState
    begun: float
    events: list[tuple[Input, tuple[Output, ...]]] = field(default_factory=list)
    bytes: int = 0


class IncidentRecorder:
    """Keeps the last seconds of a localizer in memory.

    One thread observes; others may take an incident.

    Parameters
    ----------
    seconds : float
        At least so long a time is kept, by the stamps of the inputs, and at most a third more;
        less only where the inputs exceed 64 MiB, or after a new map.

    Examples
    --------
    >>> from firstfix.localizer.incident import Cause, IncidentRecorder
    >>> localizer, recorder = ff.Localizer(), IncidentRecorder(seconds=30.0)
    >>> for given in [ff.NewMap(0.0, grid), ff.Odometry(0.0, (0.0, 0.0, 0.0)), scan]:
    ...     cause = recorder.observe(given, localizer.handle(given), localizer)
    >>> len(recorder.take(Cause.REQUESTED, "a look").inputs)
    2
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._parts: deque[_Part] = deque()
        self._localizer: Localizer | None = None
        self._map: NewMap | None = None
        self._state = State.NO_MAP
        self._stamp = 0.0
        self._lock = threading.Lock()

    def observe(self, given: Input, outputs: list[Output], localizer: object) -> Cause | None:
        """Keep an input with its outputs.

        Parameters
        ----------
        given : Input
            The input.
        outputs : list of Output
            What `Localizer.handle` returned for it.
        localizer : Localizer
            After the input. Of another one, such as that of a site, nothing is kept.

        Returns
        -------
        Cause or None
            Why an incident should be saved now; None if nothing has happened.
        """
        if not isinstance(localizer, Localizer):
            return None
        with self._lock:
            before, self._state = self._state, localizer.state
            if isinstance(given, NewMap) or localizer is not self._localizer:
                self._begin(given, localizer)
                return None
            if self._map is None:
                return None
            self._keep(given, tuple(outputs), localizer)
        return _cause(before, given, outputs, self._state)

    def take(self, cause: Cause, reason: str) -> Incident | None:
        """Return what is kept, at any time and from any thread; None before the first map."""
        with self._lock:
            if self._map is None or self._localizer is None or not self._parts:
                return None
            events = [event for part in self._parts for event in part.events]
            return Incident(
                cause=cause,
                reason=reason,
                stamp=self._stamp,
                config=self._localizer.config,
                map=self._map,
                start=self._parts[0].start,
                inputs=tuple(given for given, _ in events),
                outputs=tuple(outputs for _, outputs in events),
            )

    def _begin(self, given: Input, localizer: Localizer) -> None:
        """Start anew: one file has one map, and the inputs of one localizer."""
        self._parts.clear()
        self._localizer = localizer
        if isinstance(given, NewMap):
            self._map = given
        elif localizer.matcher is None:
            self._map = None
        if self._map is not None:
            self._stamp = given.stamp
            self._parts.append(_Part(_written(localizer), given.stamp))

    def _keep(self, given: Input, outputs: tuple[Output, ...], localizer: Localizer) -> None:
        part = self._parts[-1]
        part.events.append((given, outputs))
        part.bytes += given.ranges.nbytes if isinstance(given, LaserScan) else _SMALL_BYTES
        self._stamp = given.stamp
        passed = given.stamp - part.begun
        is_full = len(part.events) >= _MOST_INPUTS // _PARTS or part.bytes >= _MOST_BYTES // _PARTS
        if is_full or not 0.0 <= passed < self._seconds / _PARTS:
            self._parts.append(_Part(_written(localizer), given.stamp))
            while len(self._parts) > _PARTS + 1:
                self._parts.popleft()


def _written(localizer: Localizer) -> WrittenState:
    encoder = Encoder(known_parts(localizer))
    value = write_state(localizer, encoder)
    return WrittenState(value, encoder.nodes, bytes(encoder.arrays))


def _cause(before: State, given: Input, outputs: list[Output], now: State) -> Cause | None:
    if isinstance(given, PoseHint):
        return None if now in (State.VERIFYING_HINT, State.LIFTED) else Cause.REFUSED_HINT
    if not any(isinstance(output, Status) for output in outputs):
        return None
    if not isinstance(given, (LaserScan, Odometry)):
        return None  # saved on request
    if before is State.VERIFYING_HINT and now is State.SEARCHING:
        return Cause.REFUSED_HINT
    if before is not State.LOCALIZED:
        return None
    if now is State.SEARCHING:
        return Cause.LOST_POSE
    was_moved = any(isinstance(output, InitialPose) for output in outputs)
    return Cause.REVOKED_POSE if now is State.DISAMBIGUATING or was_moved else None
