"""Cases: a map, scans taken in it, and the true poses; and scans cut to smaller sensors.

A case is a folder with ``map.yaml`` and its image, ``scans.npz``, and optionally ``meta.json``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map

RECORDED = "recorded"
"""The sensor of the recording, uncut."""

# From here on a sensor sees all round, and its own angle 0 is the middle of a smaller view.
_ALL_ROUND = math.radians(350.0)
_EPS_RAD = math.radians(0.01)


@dataclass(frozen=True, slots=True)
class SensorCut:
    """A sensor with a smaller view or range than the recorded one.

    Parameters
    ----------
    fov : float
        Field of view, rad. Beams outside it are NaN.
    range_max : float
        Range, m. Longer measurements are ``inf``.
    """

    fov: float
    range_max: float

    def __str__(self) -> str:
        return f"{math.degrees(self.fov):g}° x {self.range_max:g} m"

    def apply(self, scan: LaserScan) -> LaserScan:
        """Return what this sensor would have measured at the place of a scan."""
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan))
        sees_all_round = abs(scan.angle_increment) * len(scan) >= _ALL_ROUND
        middle = 0.0 if sees_all_round else angles[len(scan) // 2]
        off_middle = np.abs((angles - middle + FULL_TURN / 2) % FULL_TURN - FULL_TURN / 2)
        ranges = scan.ranges.copy()
        ranges[ranges > self.range_max] = np.inf
        ranges[off_middle > self.fov / 2 + _EPS_RAD] = np.nan
        return replace(scan, ranges=ranges, range_max=min(scan.range_max, self.range_max))


def parse_sensor(text: str) -> SensorCut | None:
    """Read ``FOV,RANGE`` (degrees, m), or ``recorded``, which is None.

    Raises
    ------
    InputError
        If it is neither.
    """
    if text == RECORDED:
        return None
    try:
        fov_deg, range_max = (float(part) for part in text.split(","))
    except ValueError:
        fov_deg, range_max = math.nan, math.nan
    if not (0.0 < fov_deg <= 360.0 and 0.0 < range_max < math.inf):
        raise InputError(
            expected=f"--sensor FOV,RANGE in degrees (up to 360) and metres, or {RECORDED}",
            received=repr(text),
            remedy="write it like --sensor 60,5",
        )
    return SensorCut(math.radians(fov_deg), range_max)


@dataclass(frozen=True, slots=True)
class Case:
    """A case that is loaded where it is needed: small enough to send to another process.

    Parameters
    ----------
    name : str
        Its name in tables.
    site : str
        Cases with one site are the same building.
    kind : str
        Where the scans come from, such as ``real`` or ``sim``.
    grid, recording : callable
        Load the map, and the scans with their true poses.
    sensor : str
        The sensor that the scans are cut to.
    """

    name: str
    site: str
    kind: str
    grid: Callable[[], OccupancyGrid]
    recording: Callable[[], Recording]
    sensor: str = RECORDED

    def seen_by(self, sensor: SensorCut | None) -> Case:
        """Return the case with its scans cut to a sensor; None leaves them as they are."""
        if sensor is None:
            return self
        recording = partial(_cut_recording, self.recording, sensor)
        return replace(self, recording=recording, sensor=str(sensor))


def find_cases(folders: Sequence[Path]) -> list[Case]:
    """List the cases in folders: cases, or folders of cases. Only ``meta.json`` is read.

    Raises
    ------
    InputError
        If a folder neither is nor holds a case, or a ``meta.json`` is broken.
    """
    return [_case(folder) for given in folders for folder in _case_folders(given)]


def next_elsewhere(cases: Sequence[Case], i: int) -> Case | None:
    """Return the next case after case i, cyclically, in another building; None if there is none."""
    following = [*cases[i + 1 :], *cases[:i]]
    return next((other for other in following if other.site != cases[i].site), None)


def known_truth(case: Case, recording: Recording) -> NDArray[np.float64]:
    """Return ``T_map_base`` at the scans of a case, shape (n_scans, 3); NaN rows are unknown.

    Raises
    ------
    InputError
        If no true pose is known.
    """
    if recording.truth is None or not np.isfinite(recording.truth).all(axis=1).any():
        raise InputError(
            expected=f"case {case.name} with true poses",
            received="a recording without",
            remedy="add `true_pose` to its scans.npz, or leave the case out",
        )
    return recording.truth


def truth_at(recording: Recording, index: int) -> SE2 | None:
    """Return ``T_map_base`` at a scan; None where the log has none."""
    if recording.truth is None or not np.isfinite(recording.truth[index]).all():
        return None
    return SE2.from_array(recording.truth[index])


def known_poses(case: Case, recording: Recording, limit: int) -> dict[int, SE2]:
    """Return the scans of a case to try, evenly spaced, at most ``limit`` (0: all).

    Returns
    -------
    dict of int to SE2
        Index of each scan in the recording, and its true ``T_map_base``.

    Raises
    ------
    InputError
        If no true pose is known.
    """
    truth = known_truth(case, recording)
    tried = evenly_spaced(np.flatnonzero(np.isfinite(truth).all(axis=1)), limit)
    return {i: SE2.from_array(truth[i]) for i in tried.tolist()}


def evenly_spaced(indices: NDArray[np.intp], limit: int) -> NDArray[np.intp]:
    """Thin out indices evenly, first and last kept, to at most ``limit`` (0: all)."""
    if limit <= 0 or len(indices) <= limit:
        return indices
    return indices[np.linspace(0, len(indices) - 1, limit).round().astype(np.intp)]


def _cut_recording(load: Callable[[], Recording], sensor: SensorCut) -> Recording:
    recording = load()
    return replace(recording, scans=tuple(sensor.apply(scan) for scan in recording.scans))


def _case_folders(given: Path) -> list[Path]:
    if _is_case(given):
        return [given]
    inside = sorted(p for p in given.iterdir() if _is_case(p)) if given.is_dir() else []
    if not inside:
        raise InputError(
            expected="a case: a folder with map.yaml and scans.npz, or a folder of such folders",
            received=f"{given}{'' if given.exists() else ' (no such folder)'}",
            remedy="name the folder of a case",
        )
    return inside


def _is_case(folder: Path) -> bool:
    return (folder / "map.yaml").is_file() and (folder / "scans.npz").is_file()


def _case(folder: Path) -> Case:
    name = folder.resolve().name
    meta = _meta(folder / "meta.json")
    return Case(
        name=name,
        site=str(meta.get("site", name)),
        kind=str(meta.get("kind", "unknown")),
        grid=partial(load_map, folder / "map.yaml"),
        recording=partial(load_recording, folder / "scans.npz"),
    )


def _meta(path: Path) -> dict[str, Any]:
    if not path.exists():
        return {}
    try:
        meta = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(
            expected=f"{path} as JSON",
            received=f"{type(error).__name__}: {error}",
            remedy="correct the file, or remove it",
        ) from None
    if not isinstance(meta, dict):
        raise InputError(
            expected=f"{path} as a JSON object",
            received=type(meta).__name__,
            remedy='write {"site": ..., "kind": ...}',
        )
    return meta
