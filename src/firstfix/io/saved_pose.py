"""The last pose of a robot, kept on disk so that it outlives a restart."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.cache import content_key
from firstfix.io.atomic_files import read_bytes, replace_file, show

MAX_POSITION_M = 1e9
"""No robot is farther from its origin; transforms of such numbers stay finite."""
MAX_VARIANCE = 1e12
"""Beyond, m² or rad², nothing is known that could be kept."""
MAX_KEY_LENGTH = 200

_FORMAT = "firstfix saved pose 1"
# A real one is 500 bytes.
_MAX_BYTES = 16_384
# Of the largest entry: what is left of symmetry and of a zero eigenvalue after rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, slots=True)
class SavedPose:
    """Where a robot was, how sure that was, and what is needed to judge it later.

    Parameters
    ----------
    T_map_base : SE2
        Pose of the base in the map.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame. Made read-only.
    stamp : float
        When the robot was there, s since the epoch, by the clock of the scans.
    T_odom_base : SE2 or None
        Odometry at this time; None where there is none.
    map_key : str
        Which map this is a pose in, from `map_key`.

    Raises
    ------
    InputError
        If a number is not finite or far out of proportion, the covariance is none, or the key is
        empty or longer than `MAX_KEY_LENGTH`.
    """

    T_map_base: SE2
    covariance: NDArray[np.float64]
    stamp: float
    T_odom_base: SE2 | None
    map_key: str

    def __post_init__(self) -> None:
        for pose in (self.T_map_base, self.T_odom_base):
            if pose is not None and max(abs(pose.x), abs(pose.y)) > MAX_POSITION_M:
                received = f"({pose.x:g}, {pose.y:g})"
                raise _unfit(f"a position within {MAX_POSITION_M:g} m of the origin", received)
        if not math.isfinite(self.stamp):
            raise _unfit("a finite stamp", f"{self.stamp}")
        if not 0 < len(self.map_key) <= MAX_KEY_LENGTH:
            received = f"one of {len(self.map_key)}"
            raise _unfit(f"a key of the map, 1 to {MAX_KEY_LENGTH} characters", received)
        object.__setattr__(self, "stamp", float(self.stamp))
        object.__setattr__(self, "covariance", _checked_covariance(self.covariance))


def map_key(grid: OccupancyGrid) -> str:
    """Return what tells this map from others: its cells and where they lie.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.

    Returns
    -------
    str
        The same for the same map, whatever file it came from.
    """
    place = np.append(grid.T_map_grid.as_array(), grid.resolution)
    return content_key("map 1", grid.cells, place)


def save_pose(path: str | os.PathLike[str], saved: SavedPose) -> None:
    """Write a pose to a JSON file, all or nothing, also when the power fails meanwhile.

    Parameters
    ----------
    path : path-like
        Where to, in a folder that exists; an existing file is replaced.
    saved : SavedPose
        What `load_pose` will return, to the last bit.

    Raises
    ------
    InputError
        If it cannot be written; an old file is then as it was.
    """
    document = {
        "format": _FORMAT,
        "map_key": saved.map_key,
        "stamp": saved.stamp,
        "T_map_base": saved.T_map_base.as_array().tolist(),
        "covariance": saved.covariance.tolist(),
        "T_odom_base": None if saved.T_odom_base is None else saved.T_odom_base.as_array().tolist(),
    }
    replace_file(Path(path), [json.dumps(document, indent=1).encode(), b"\n"])


def load_pose(path: str | os.PathLike[str]) -> SavedPose:
    """Read a pose that `save_pose` wrote.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    SavedPose
        Checked, but not judged: see `firstfix.io.recalled_pose.recall`.

    Raises
    ------
    InputError
        If there is no such file, or it holds anything else.
    """
    path = Path(path)
    data = read_bytes(path, what="a saved pose", limit=_MAX_BYTES)
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        raise _wrong(path, "JSON", "something else") from None
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise _wrong(path, f'a mapping with "format": "{_FORMAT}"', show(document))
    entry = _Entries(path, document)
    odometry = None if entry.get("T_odom_base") is None else entry.pose("T_odom_base")
    pose, covariance = entry.pose("T_map_base"), entry.numbers("covariance", (3, 3))
    stamp, key = float(entry.numbers("stamp", ())), entry.text("map_key")
    try:
        return SavedPose(pose, covariance, stamp, odometry, key)
    except InputError as error:
        raise _wrong(path, error.expected, error.received) from error


@dataclass(frozen=True, slots=True)
class _Entries:
    """The entries of one file."""

    path: Path
    document: dict[str, Any]

    def get(self, key: str) -> Any:
        if key not in self.document:
            raise _wrong(self.path, f"an entry {key}", f"only {show(', '.join(self.document))}")
        return self.document[key]

    def text(self, key: str) -> str:
        value = self.get(key)
        if not isinstance(value, str):
            raise _wrong(self.path, f"a text for {key}", show(value))
        return value

    def numbers(self, key: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
        value = self.get(key)
        if not _is_numbers(value, shape):
            expected = f"finite numbers of shape {shape}" if shape else "a finite number"
            raise _wrong(self.path, f"{expected} for {key}", show(value))
        return np.array(value, np.float64)

    def pose(self, key: str) -> SE2:
        return SE2.from_array(self.numbers(key, (3,)))


def _is_numbers(value: Any, shape: tuple[int, ...]) -> bool:
    """Tell whether this is nested lists of numbers that a float can hold, and of this shape."""
    if shape:
        fits = isinstance(value, list) and len(value) == shape[0]
        return fits and all(_is_numbers(item, shape[1:]) for item in value)
    if isinstance(value, float):
        return math.isfinite(value)
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _checked_covariance(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    matrix = np.array(covariance, np.float64)
    if matrix.shape != (3, 3) or not (np.abs(matrix) <= MAX_VARIANCE).all():
        expected = f"a covariance of shape (3, 3), of finite numbers up to {MAX_VARIANCE:g}"
        raise _unfit(expected, show(matrix.tolist()))
    rounding = _ROUNDING * float(np.abs(matrix).max())
    symmetric = 0.5 * (matrix + matrix.T)
    if np.abs(matrix - symmetric).max() > rounding:
        raise _unfit("a symmetric covariance", show(matrix.tolist()))
    if np.linalg.eigvalsh(symmetric).min() < -rounding:
        raise _unfit("a covariance without negative eigenvalues", show(matrix.tolist()))
    symmetric.flags.writeable = False
    return symmetric


def _unfit(expected: str, received: str) -> InputError:
    return InputError(expected=expected, received=received, remedy="look where it comes from")


def _wrong(path: Path, expected: str, received: str) -> InputError:
    return InputError(
        expected=f"{expected} in {path}",
        received=received,
        remedy="delete the file; the robot then starts without a saved pose",
    )
