"""The last seconds of a localizer, and the recorder that keeps them.

A localizer has no clock and the same inputs give the same outputs. So its state at one time and the
inputs since are enough to repeat its outputs to the last bit
([0029](../../docs/decisions/0029-incidents.md)).
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.checkpoint import known_parts, write_state
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import Input, NewMap, PoseHint
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, MapSwitched, NamedMap, Output, Status
from firstfix.localizer.state_codec import Encoder
from firstfix.localizer.states import State

# The state is written so many times in the seconds that are kept: they are exceeded by one part.
_PARTS = 3
# Limits of what is kept, whatever the rates of the sensors.
_MOST_INPUTS = 20_000
_MOST_BYTES = 64 * 2**20
_SMALL_BYTES = 1000  # of an input without ranges, roughly


KeptOutput = Output | NamedMap
"""An output as incidents keep it."""


class Watched(Protocol):
    """A localizer of one map or of many, as the recorder sees it."""

    config: LocalizerConfig

    @property
    def state(self) -> State:
        """The state."""

    @property
    def matcher(self) -> ScanMatcher | None:
        """Global localization on the map in use; None before the first map."""


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
    map : NewMap or None
        The map in use; None in a site, whose maps `start` names.
    start : WrittenState
        The state before the first input.
    inputs : tuple of Input
        In the order in which they were handled; no map among them.
    outputs : tuple of tuple of Output or NamedMap
        Of each input; a `NamedMap` in place of each `MapSwitched`.
    """

    cause: Cause
    reason: str
    stamp: float
    config: LocalizerConfig
    map: NewMap | None
    start: WrittenState
    inputs: tuple[Input, ...]
    outputs: tuple[tuple[KeptOutput, ...], ...]


@dataclass(eq=False, slots=True)
class _Part:
    """A state, and what followed."""

    start: WrittenState
    begun: float
    events: list[tuple[Input, tuple[KeptOutput, ...]]] = field(default_factory=list)
    bytes: int = 0


class IncidentRecorder:
    """Keeps the last seconds of a localizer in memory.

    One thread observes; others may take an incident.

    Parameters
    ----------
    seconds : float
        At least so long a time is kept, by the stamps of the inputs, and at most a third more;
        less only where the inputs exceed 64 MiB, or after a new map.
    write : callable, optional
        Returns the state of the localizer; by default, of a `Localizer` with a map.

    Examples
    --------
    >>> from firstfix.localizer.incident import Cause, IncidentRecorder
    >>> localizer, recorder = ff.Localizer(), IncidentRecorder(seconds=30.0)
    >>> for given in [ff.NewMap(0.0, grid), ff.Odometry(0.0, (0.0, 0.0, 0.0)), scan]:
    ...     cause = recorder.observe(given, localizer.handle(given), localizer)
    >>> len(recorder.take(Cause.REQUESTED, "a look").inputs)
    2
    """

    def __init__(self, seconds: float, write: Callable[[Any], WrittenState] | None = None) -> None:
        self._seconds = seconds
        self._write: Callable[[Any], WrittenState] = write or written
        self._parts: deque[_Part] = deque()
        self._localizer: Watched | None = None
        self._map: NewMap | None = None
        self._state = State.NO_MAP
        self._stamp = 0.0
        self._lock = threading.Lock()

    def observe(self, given: Input, outputs: list[Output], localizer: Watched) -> Cause | None:
        """Keep an input with its outputs.

        Parameters
        ----------
        given : Input
            The input.
        outputs : list of Output
            What `Localizer.handle` returned for it.
        localizer : Localizer or SiteLocalizer
            After the input.

        Returns
        -------
        Cause or None
            Why an incident should be saved now; None if nothing has happened.
        """
        has_one_map = isinstance(localizer, Localizer)
        if isinstance(given, NewMap) and not has_one_map:
            return None  # it names the map of a site to observers; the localizer has not got it
        with self._lock:
            before, self._state = self._state, localizer.state
            if isinstance(given, NewMap) or localizer is not self._localizer:
                self._begin(given, localizer, has_one_map=has_one_map)
                return None
            if not self._parts:
                return None
            self._keep(given, kept(outputs), localizer)
        return _cause(before, given, outputs, self._state)

    def take(self, cause: Cause, reason: str) -> Incident | None:
        """Return what is kept, at any time and from any thread; None before the first map."""
        with self._lock:
            if self._localizer is None or not self._parts:
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

    def _begin(self, given: Input, localizer: Watched, *, has_one_map: bool) -> None:
        """Start anew: one file has one map, and the inputs of one localizer."""
        self._parts.clear()
        self._localizer = localizer
        if isinstance(given, NewMap):
            self._map = given
        elif localizer.matcher is None or not has_one_map:
            self._map = None
        if self._map is not None or not has_one_map:
            self._stamp = given.stamp
            self._parts.append(_Part(self._write(localizer), given.stamp))

    def _keep(self, given: Input, outputs: tuple[KeptOutput, ...], localizer: Watched) -> None:
        part = self._parts[-1]
        part.events.append((given, outputs))
        part.bytes += given.ranges.nbytes if isinstance(given, LaserScan) else _SMALL_BYTES
        self._stamp = given.stamp
        passed = given.stamp - part.begun
        is_full = len(part.events) >= _MOST_INPUTS // _PARTS or part.bytes >= _MOST_BYTES // _PARTS
        if is_full or not 0.0 <= passed < self._seconds / _PARTS:
            self._parts.append(_Part(self._write(localizer), given.stamp))
            while len(self._parts) > _PARTS + 1:
                self._parts.popleft()


def written(localizer: Localizer) -> WrittenState:
    """Return the state of a localizer with a map."""
    encoder = Encoder(known_parts(localizer))
    value = write_state(localizer, encoder)
    return WrittenState(value, encoder.nodes, bytes(encoder.arrays))


def kept(outputs: Iterable[Output]) -> tuple[KeptOutput, ...]:
    """Return outputs as incidents keep them: without maps."""
    return tuple(
        NamedMap(each.stamp, each.map_id) if isinstance(each, MapSwitched) else each
        for each in outputs
    )


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
