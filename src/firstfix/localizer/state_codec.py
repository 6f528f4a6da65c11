"""Inputs, outputs and the state of a localizer as plain values, and back, to the last bit.

Values are JSON plus one block of bytes for the arrays. Nothing is unpickled: only the classes that
are listed here are made, with checked fields, so that a file of a stranger is data and never code.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import fields
from enum import Enum
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.clusters import Cluster
from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.amcl.filter import FilterState
from firstfix.amcl.particles import Particles
from firstfix.amcl.recovery import WeightHistory
from firstfix.amcl.tracker import Track
from firstfix.belief import hints, judge
from firstfix.belief.belief import Belief
from firstfix.belief.config import BeliefConfig
from firstfix.belief.prior import All, AnyOf, Gaussian, Near, Region
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Link, Observation, View
from firstfix.core.errors import InputError
from firstfix.core.estimate import Evidence, Hypothesis, SearchReport, Verdict
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import LocateConfig, Method
from firstfix.global_localization.prior import Prior
from firstfix.localizer import hint, pose_monitor
from firstfix.localizer.config import ChangesConfig, LocalizerConfig, MonitorConfig, ScansConfig
from firstfix.localizer.inputs import MapHint, NoMotionUpdate, PoseHint, PositionFix, Reset
from firstfix.localizer.outputs import (
    Hypotheses,
    InitialPose,
    MotionRequest,
    NamedMap,
    Status,
    TrackedPose,
)
from firstfix.localizer.pose_fusion import SharpPose
from firstfix.localizer.pose_tracker import Tracked
from firstfix.localizer.sensor_clocks import Clock
from firstfix.localizer.states import State

T = TypeVar("T")

# A value may be used twice, but not so often that a small file unfolds to a huge one.
_MOST_PARTS = 3_000_000
# Farther away nothing is, m; indices of cells stay small.
_FARTHEST = 1e7

_CLASSES: dict[str, type[Any]] = {
    "belief.Hint": hints.Hint,
    "belief.Judgement": judge.Judgement,
    "localizer.Hint": hint.Hint,
    "localizer.Judgement": pose_monitor.Judgement,
} | {
    each.__name__: each
    for each in (
        *(SE2, LaserScan, Odometry, Signal, PoseHint, PositionFix, Reset, NoMotionUpdate, MapHint),
        *(Near, Gaussian, Region, AnyOf, All),
        *(InitialPose, TrackedPose, Hypotheses, MotionRequest, Status, NamedMap),
        *(Evidence, Hypothesis, SearchReport),
        *(LocalizerConfig, LocateConfig, AmclConfig, MonitorConfig, BeliefConfig, ScansConfig),
        *(ChangesConfig, View, Observation, Tracks, Belief, judge.Favourite),
        *(Particles, Cluster, FilterState, WeightHistory, Track, Tracked, SharpPose, Clock),
    )
}
_NAMES = {each: name for name, each in _CLASSES.items()}
_ENUMS = {
    each.__name__: each
    for each in (
        *(State, Verdict, SignalKind, Mounting, Method, MotionModel, SensorModel),
        *(hints.Source, pose_monitor.Fit, Link),
    )
}
_DTYPES = ("<f8", "<f4", "<i8", "<i4", "|b1", "|i1", "|u1")


class Encoder:
    """Turns values into plain ones.

    A value that occurs twice is written once, so that identity survives.

    Parameters
    ----------
    known : mapping from str to object
        What is not written but named, such as the prepared map.
    """

    def __init__(self, known: dict[str, object] | None = None) -> None:
        self.nodes: list[list[Any]] = []
        self.arrays = bytearray()
        self._known = {id(value): name for name, value in (known or {}).items()}
        self._written: dict[int, tuple[int, object]] = {}  # the object, so that its id stays taken

    def encode(self, value: object) -> Any:
        """Return a plain value; objects and arrays go to `nodes` and `arrays`.

        Raises
        ------
        TypeError
            If the class is not listed in this module: a defect of the program.
        """
        if isinstance(value, np.generic):
            return {"number": [value.dtype.str, value.item()]}
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if id(value) in self._known:
            return {"known": self._known[id(value)]}
        if isinstance(value, Enum):
            return {"enum": [type(value).__name__, value.name]}
        if isinstance(value, (tuple, list)):
            kind = "tuple" if isinstance(value, tuple) else "list"
            return {kind: [self.encode(each) for each in value]}
        if isinstance(value, deque):
            return {"deque": [value.maxlen, [self.encode(each) for each in value]]}
        if isinstance(value, (set, frozenset)):
            return {"set": [self.encode(each) for each in sorted(value, key=str)]}
        if isinstance(value, dict):
            return {"dict": [[self.encode(key), self.encode(value[key])] for key in value]}
        if id(value) not in self._written:
            node = self._array(value) if isinstance(value, np.ndarray) else self._object(value)
            self.nodes.append(node)
            self._written[id(value)] = len(self.nodes) - 1, value
        return {"node": self._written[id(value)][0]}

    def _object(self, value: object) -> list[Any]:
        name = _NAMES.get(type(value))
        if name is None:
            raise TypeError(f"{type(value).__name__} is not listed in {__name__}")
        content = {
            each.name: self.encode(getattr(value, each.name))
            for each in fields(value)  # type: ignore[arg-type]
            if each.init
        }
        return [name, content]

    def _array(self, value: NDArray[Any]) -> list[Any]:
        # Sums depend on the order in memory, so that the order of the axes is kept, too.
        axes = sorted(range(value.ndim), key=lambda axis: -abs(value.strides[axis]))
        dense = np.ascontiguousarray(value.transpose(axes)) if value.ndim else value
        start = len(self.arrays)
        self.arrays += dense.tobytes()
        return ["array", dense.dtype.str, list(dense.shape), axes, start]


class Decoder:
    """Turns plain values back, and checks every one.

    Parameters
    ----------
    nodes : list
        Of `Encoder.nodes`.
    arrays : bytes
        Of `Encoder.arrays`.
    known : mapping from str to object
        What was named instead of written.

    Raises
    ------
    InputError
        If a node is not what an `Encoder` writes.
    """

    def __init__(
        self, nodes: object, arrays: bytes, known: dict[str, object] | None = None
    ) -> None:
        self._arrays = arrays
        self._known = known or {}
        self._made: list[Any] = []
        self._parts: list[int] = []
        self._counted = 0
        for node in _list(nodes):
            self._counted = 0
            made = self._make(_list(node))
            self._made.append(made)
            self._parts.append(1 + self._counted)

    def decode(self, value: object, hint: Any) -> Any:
        """Return the value that was encoded.

        Raises
        ------
        InputError
            If it is not of the type ``hint``.
        """
        self._counted = 0
        decoded = self._value(value)
        if not _matches(decoded, hint):
            raise _damaged(f"a {type(decoded).__name__} where {hint!s:.80} belongs")
        return decoded

    def _make(self, node: list[Any]) -> Any:
        if node[:1] == ["array"]:
            return self._array(node)
        if len(node) != 2 or not isinstance(node[0], str) or node[0] not in _CLASSES:
            raise _damaged("an unknown class")
        kind, content = _CLASSES[node[0]], node[1]
        if not isinstance(content, dict):
            raise _damaged(f"a {node[0]} without fields")
        declared = {each.name for each in fields(kind) if each.init}
        if set(content) != declared:
            raise _damaged(f"a {node[0]} with other fields: the versions of firstfix may differ")
        given = {name: self._value(content[name]) for name in declared}
        types = _types_of(kind)
        for name in declared:
            if not _matches(given[name], types[name]):
                raise _damaged(f"{node[0]}.{name} of another type")
        if kind is SE2:
            return _pose(**given)
        made = kind(**given)
        check = _CHECKS.get(kind)
        if check is not None and not check(made):
            raise _damaged(f"a {node[0]} with impossible numbers")
        return made

    def _array(self, node: list[Any]) -> NDArray[Any]:
        _, kind, shape, axes, start = node
        if kind not in _DTYPES or not _matches(shape, list[int]) or not _matches(axes, list[int]):
            raise _damaged("an array of another type")
        size = math.prod(shape) * np.dtype(kind).itemsize
        if any(n < 0 for n in shape) or sorted(axes) != list(range(len(shape))):
            raise _damaged("an array of impossible shape")
        if not isinstance(start, int) or not 0 <= start <= start + size <= len(self._arrays):
            raise _damaged("an array that is not there")
        dense = np.frombuffer(self._arrays[start : start + size], kind).reshape(shape).copy()
        return dense.transpose(np.argsort(axes)) if axes else dense

    def _value(self, value: Any) -> Any:
        self._counted += 1
        if self._counted > _MOST_PARTS:
            raise _damaged("too many parts")
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if not isinstance(value, dict) or len(value) != 1:
            raise _damaged("an unknown value")
        ((kind, content),) = value.items()
        if kind == "node":
            if type(content) is not int or not 0 <= content < len(self._made):
                raise _damaged("a value that is not there")
            self._counted += self._parts[content]
            return self._made[content]
        if kind == "known":
            if not isinstance(content, str) or content not in self._known:
                raise _damaged("an unknown name")
            return self._known[content]
        return self._container(kind, _list(content))

    def _container(self, kind: str, content: list[Any]) -> Any:
        if kind in ("tuple", "list", "set"):
            values = [self._value(each) for each in content]
            return {"tuple": tuple, "list": list, "set": set}[kind](values)
        if kind == "dict":
            return {self._value(key): self._value(value) for key, value in map(_list, content)}
        first, second = content
        if kind == "deque" and (first is None or (type(first) is int and 0 <= first <= 10**6)):
            return deque((self._value(each) for each in _list(second)), maxlen=first)
        if kind == "number" and first in _DTYPES and isinstance(second, (bool, int, float)):
            return np.dtype(first).type(second)
        if kind == "enum" and isinstance(second, str) and first in _ENUMS:
            return _ENUMS[first][second]
        raise _damaged("an unknown value")


def _pose(x: float, y: float, yaw: float) -> SE2:
    """Make a pose whose bits are those given: `SE2` would wrap its heading again."""
    pose = SE2(x, y, yaw)
    if -math.pi < yaw <= math.pi:
        object.__setattr__(pose, "yaw", yaw)
    return pose


def _list(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise _damaged("a value that is no list")
    return value


def _damaged(what: str) -> InputError:
    return InputError(f"The file is damaged or of another version of firstfix: it has {what}.")


# ---- checks of types

_HINTS: dict[type[Any], dict[str, Any]] = {}


def _types_of(kind: type[Any]) -> dict[str, Any]:
    if kind not in _HINTS:
        _HINTS[kind] = get_type_hints(kind)
    return _HINTS[kind]


def _matches(value: Any, hint: Any) -> bool:
    """Return whether a value is of a type that an annotation names."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint is Any:
        return True
    if hint is float:
        return isinstance(value, (int, float, np.floating)) and not isinstance(value, bool)
    if hint is int:
        return isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if hint is bool:
        return isinstance(value, (bool, np.bool_))
    if hint is Prior:
        return isinstance(value, (Near, Gaussian, Region, AnyOf, All))
    if origin is None:
        return value is None if hint in (None, type(None)) else isinstance(value, hint)
    if origin is np.ndarray:
        kinds = get_args(arguments[1])
        return isinstance(value, np.ndarray) and (
            not kinds or kinds[0] is Any or issubclass(value.dtype.type, kinds[0])
        )
    if origin is dict:
        return isinstance(value, dict) and all(
            _matches(key, arguments[0]) and _matches(each, arguments[1])
            for key, each in value.items()
        )
    if origin is tuple and not (len(arguments) == 2 and arguments[1] is ...):
        return (
            isinstance(value, tuple)
            and len(value) == len(arguments)
            and all(map(_matches, value, arguments))
        )
    if origin in (tuple, list, set, deque):
        return isinstance(value, origin) and _all_match(value, arguments[0])
    if isinstance(origin, type) and issubclass(origin, Iterable):  # Sequence
        return isinstance(value, (tuple, list)) and _all_match(value, arguments[0])
    return origin in (Union, _UNION) and any(_matches(value, each) for each in arguments)


_UNION = type(int | str)


def _all_match(values: Iterable[Any], hint: Any) -> bool:
    return all(_matches(each, hint) for each in values)


# ---- checks of numbers: the kernels that read these arrays trust them


def _near(array: NDArray[Any], *shape: int) -> bool:
    return array.shape == shape and bool((np.abs(array) <= _FARTHEST).all())


def _check_tracks(tracks: Tracks) -> bool:
    n, v = len(tracks.ids), tracks.costs.shape[-1]
    sizes = (tracks.costs.shape, tracks.strains.shape, tracks.careful.shape)
    return tracks.ids.ndim == 1 and sizes == ((n, v),) * 3 and _near(tracks.poses, n, v, 3)


def _check_particles(particles: Particles) -> bool:
    n = particles.x.size
    arrays = (particles.x, particles.y, particles.yaw, particles.weight)
    return n > 0 and all(_near(array, n) for array in arrays)


def _check_belief(belief: Belief) -> bool:
    n, window = len(belief.tracks), belief.window
    resolution = belief.fields.grid.resolution
    return (
        belief.probabilities.shape == (n,)
        and belief.tracks.costs.shape[1] == max(1, len(window))
        and all(seen.resolution == resolution for seen in window)
    )


_CHECKS: dict[type[Any], Callable[[Any], bool]] = {
    Tracks: _check_tracks,
    Particles: _check_particles,
    Belief: _check_belief,
    Cluster: lambda cluster: _near(cluster.covariance, 3, 3),
    FilterState: lambda state: len(state.clusters) > 0,
    Hypothesis: lambda place: place.covariance.shape == (3, 3),
    hints.Hint: lambda hint: hint.odometry is None or _near(hint.odometry, 3),
    Observation: lambda seen: len(seen.views) > 0 and seen.resolution > 0.0,
}
