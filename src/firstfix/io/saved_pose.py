"""The last pose of a robot in a JSON file, for the next start."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.cache import content_key
from firstfix.io.atomic_files import read_bytes, replace_file, show

MAX_POSITION_M = 1e9
"""Largest coordinate; transforms of such numbers stay finite."""
MAX_VARIANCE = 1e12
"""Largest variance, m² or rad²."""
MAX_KEY_LENGTH = 200

# A real one is 500 bytes.
_MAX_BYTES = 16_384
# Tolerance of symmetry and of zero eigenvalues, as a fraction of the largest entry.
_ROUNDING = 1e-9

_Row = tuple[float, float, float]


class _Document(msgspec.Struct):
    """The file."""

    format: Literal["firstfix saved pose 1"]
    map_key: str
    stamp: float
    T_map_base: _Row
    covariance: tuple[_Row, _Row, _Row]
    T_odom_base: _Row | None


@dataclass(frozen=True, eq=False, slots=True)
class SavedPose:
    """A pose with its covariance, and what is needed to verify it later.

    Parameters
    ----------
    T_map_base : SE2
        Pose of the base in the map.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame. Made read-only.
    stamp : float
        Time of the pose, s since the epoch, by the clock of the scans.
    T_odom_base : SE2 or None
        Odometry at this time; None if there is none.
    map_key : str
        The map of the pose, from `map_key`.

    Raises
    ------
    InputError
        If a number is not finite or implausible, the covariance is invalid, or the key is empty or
        longer than `MAX_KEY_LENGTH`.
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
    """Return a hash of the cells of a map and their place, whatever file it came from."""
    place = np.append(grid.T_map_grid.as_array(), grid.resolution)
    return content_key("map 1", grid.cells, place)


def save_pose(path: str | os.PathLike[str], saved: SavedPose) -> None:
    """Write a pose to a JSON file, completely or not at all, also if the power fails.

    Parameters
    ----------
    path : path-like
        In an existing folder; an existing file is replaced.
    saved : SavedPose
        `load_pose` returns the same numbers.

    Raises
    ------
    InputError
        If it cannot be written; an old file is then unchanged.
    """
    document = {
        "format": "firstfix saved pose 1",
        "map_key": saved.map_key,
        "stamp": saved.stamp,
        "T_map_base": saved.T_map_base.as_array().tolist(),
        "covariance": saved.covariance.tolist(),
        "T_odom_base": None if saved.T_odom_base is None else saved.T_odom_base.as_array().tolist(),
    }
    replace_file(Path(path), [msgspec.json.format(msgspec.json.encode(document), indent=1), b"\n"])


def load_pose(path: str | os.PathLike[str]) -> SavedPose:
    """Read a pose that `save_pose` wrote.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    SavedPose
        Valid, but possibly outdated: see `firstfix.io.recalled_pose.recall`.

    Raises
    ------
    InputError
        If there is no such file, or it is not a saved pose.
    """
    path = Path(path)
    data = read_bytes(path, what="a saved pose", limit=_MAX_BYTES)
    try:
        found = msgspec.json.decode(data, type=_Document)
        T_odom_base = None if found.T_odom_base is None else SE2(*found.T_odom_base)
        covariance = np.array(found.covariance)
        return SavedPose(
            SE2(*found.T_map_base), covariance, found.stamp, T_odom_base, found.map_key
        )
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise _wrong(path, "a saved pose", show(str(error))) from error
    except InputError as error:
        raise _wrong(path, error.expected, error.received) from error


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
    return InputError(expected=expected, received=received, remedy="check the source of the pose")


def _wrong(path: Path, expected: str, received: str) -> InputError:
    return InputError(
        expected=f"{expected} in {path}",
        received=received,
        remedy="delete the file; the robot then starts without a saved pose",
    )
