"""Hits and passes of beams, per cell and per day."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone

import numpy as np
from numpy.typing import NDArray

from firstfix.changes.kernels import add_view, mark_beams
from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields

DAYS_KEPT = 7

# A view from nearly the same pose repeats the same people and the same noise.
_NEXT_VIEW_M = 0.3
_NEXT_VIEW_RAD = math.radians(45.0)

# Walls are drawn to about a decimetre, and a cell on either side is rounding.
_TOLERANCE_M = 0.15
_TOLERANCE_CELLS = 1.5
# Two standard deviations of the pose are added. Where they are more, a beam says too little.
_MOST_TOLERANCE_M = 0.5
_MOST_SIGMA_M = 0.15
LONGEST_M = 15.0
"""Farther away nothing is counted, m."""

# A scan that fits no better than this may have been taken elsewhere.
LEAST_EXPLAINED = 0.5

_SECONDS_A_DAY = 86400.0
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


@dataclass(frozen=True, eq=False)
class DayCounts:
    """What the views of one day say about each cell of a map.

    Parameters
    ----------
    day : int
        Days since 1970-01-01, UTC, of the stamps.
    hits, near, passes : ndarray of uint16, shape (height, width)
        Number of views in which a beam ended in the cell (in a wall of the map: within the
        tolerance of it), in the cell or one of its eight neighbours, and in which beams only passed
        through it. Made read-only.
    views : int
        Number of views.
    beams, explained : int
        Number of beams of these views, and of those that end at a wall of the map.

    Raises
    ------
    InputError
        If the arrays are not counts of one map.
    """

    day: int
    hits: NDArray[np.uint16]
    near: NDArray[np.uint16]
    passes: NDArray[np.uint16]
    views: int
    beams: int
    explained: int

    def __post_init__(self) -> None:
        for counts in (self.hits, self.near, self.passes):
            if counts.dtype != np.uint16 or counts.ndim != 2 or counts.shape != self.hits.shape:
                raise InputError(
                    expected="hits, near and passes as uint16 of one shape",
                    received=f"{counts.dtype} of shape {counts.shape}",
                    remedy="count the views of the day again",
                )
            counts.flags.writeable = False

    @property
    def date(self) -> str:
        """The day as YYYY-MM-DD, UTC."""
        return (_EPOCH + timedelta(days=self.day)).date().isoformat()

    def merged_with(self, other: DayCounts) -> DayCounts:
        """Return the counts of both, for two robots or two drives of one day in one map.

        Raises
        ------
        InputError
            If the days or the sizes of the maps differ.
        """
        if (self.day, self.hits.shape) != (other.day, other.hits.shape):
            raise InputError(
                expected=f"counts of {self.date} in a map of shape {self.hits.shape}",
                received=f"counts of {other.date} in one of shape {other.hits.shape}",
                remedy="merge counts of the same day and map only",
            )
        return DayCounts(
            self.day,
            _sum(self.hits, other.hits),
            _sum(self.near, other.near),
            _sum(self.passes, other.passes),
            self.views + other.views,
            self.beams + other.beams,
            self.explained + other.explained,
        )


@dataclass(eq=False, slots=True)
class _OpenDay:
    """Counts that still grow."""

    hits: NDArray[np.uint16]
    near: NDArray[np.uint16]
    passes: NDArray[np.uint16]
    views: int = 0
    beams: int = 0
    explained: int = 0


class ChangeCounter:
    """Counts what the scans of a localized robot confirm and contradict in a map.

    One thread may count while another reads. Memory is bounded: a byte per cell, and six per cell
    and day.

    Parameters
    ----------
    fields : MapFields
        The prepared map.
    days_kept : int
        The oldest day is dropped when there are more.

    Examples
    --------
    >>> counter = ff.ChangeCounter(ff.ScanMatcher(grid).fields)
    >>> counter.add([scan], ff.SE2(2.0, 1.5, 0.5), np.zeros((3, 3)))
    True
    >>> counter.days[0].views
    1
    """

    def __init__(self, fields: MapFields, days_kept: int = DAYS_KEPT) -> None:
        self._fields = fields
        self._days_kept = days_kept
        self._days: dict[int, _OpenDay] = {}
        self._marks = np.zeros(fields.grid.cells.shape, np.uint8)
        self._last: SE2 | None = None
        self._lock = threading.Lock()

    @property
    def days(self) -> tuple[DayCounts, ...]:
        """A copy of the counts of each day, oldest first."""
        with self._lock:
            return tuple(
                DayCounts(
                    number,
                    day.hits.copy(),
                    day.near.copy(),
                    day.passes.copy(),
                    day.views,
                    day.beams,
                    day.explained,
                )
                for number, day in sorted(self._days.items())
            )

    @property
    def views(self) -> int:
        """Number of views of all days kept."""
        with self._lock:
            return sum(day.views for day in self._days.values())

    @property
    def explained(self) -> float:
        """Share of beams that end at a wall of the map, 0 to 1; 1 before the first beam."""
        with self._lock:
            beams = sum(day.beams for day in self._days.values())
            return sum(day.explained for day in self._days.values()) / beams if beams else 1.0

    def add(
        self, scans: Sequence[LaserScan], T_map_base: SE2, covariance: NDArray[np.float64]
    ) -> bool:
        """Count the scans of one time, if they are a new view.

        Parameters
        ----------
        scans : sequence of LaserScan
            One of each sensor; at least one.
        T_map_base : SE2
            Pose of the robot.
        covariance : ndarray, shape (3, 3)
            Of x (m), y (m), yaw (rad).

        Returns
        -------
        bool
            False if the pose is too uncertain, or hardly differs from that of the last view.
        """
        sigma_m = math.sqrt(max(0.0, float(np.linalg.eigvalsh(covariance[:2, :2])[-1])))
        sigma_rad = math.sqrt(max(0.0, float(covariance[2, 2])))
        if sigma_m > _MOST_SIGMA_M:
            return False
        if self._last is not None and not is_new_view(self._last, T_map_base):
            return False
        self._last = T_map_base
        with self._lock:
            self._count_view(scans, T_map_base, sigma_m, sigma_rad)
        return True

    def _count_view(
        self, scans: Sequence[LaserScan], T_map_base: SE2, sigma_m: float, sigma_rad: float
    ) -> None:
        day = self._day(day_of(scans[0].stamp))
        day.views += 1
        grid = self._fields.grid
        sensors = [grid.T_map_grid.inverse() @ T_map_base @ scan.T_base_laser for scan in scans]
        for scan, T_grid_laser in zip(scans, sensors, strict=True):
            beams = _beams(scan, T_grid_laser.yaw, sigma_m, sigma_rad, grid.resolution)
            day.beams += int(np.count_nonzero(beams[:, 1] * grid.resolution <= LONGEST_M))
            day.explained += self._mark(T_grid_laser, beams)
        # All sensors are marked first: a cell counts once in a view.
        for T_grid_laser in sensors:
            self._count(day, T_grid_laser)

    def _day(self, number: int) -> _OpenDay:
        """Return the counts of a day; a new day pushes out the oldest."""
        if number not in self._days:
            shape = self._fields.grid.cells.shape
            hits, near, passes = (np.zeros(shape, np.uint16) for _ in range(3))
            self._days[number] = _OpenDay(hits, near, passes)
            for old in sorted(self._days)[: -self._days_kept]:
                del self._days[old]
        # A straggler of a day that was dropped counts for the oldest that is kept.
        return self._days.get(number) or self._days[min(self._days)]

    def _mark(self, T_grid_laser: SE2, beams: NDArray[np.float64]) -> int:
        resolution = self._fields.grid.resolution
        return mark_beams(
            self._fields.clearance,
            self._fields.squares,
            self._marks,
            T_grid_laser.x / resolution,
            T_grid_laser.y / resolution,
            beams,
            LONGEST_M / resolution,
        )

    def _count(self, day: _OpenDay, T_grid_laser: SE2) -> None:
        resolution = self._fields.grid.resolution
        height, width = self._fields.grid.cells.shape
        reach = LONGEST_M + _MOST_TOLERANCE_M
        box = (
            min(size, max(0, round((at + off) / resolution)))
            for at, size in ((T_grid_laser.y, height), (T_grid_laser.x, width))
            for off in (-reach, reach)
        )
        add_view(self._marks, day.hits, day.near, day.passes, tuple(box))


def _beams(
    scan: LaserScan, yaw: float, sigma_m: float, sigma_rad: float, resolution: float
) -> NDArray[np.float64]:
    """Return heading (rad), range and tolerance (cells) of the beams that hit, shape (n, 3).

    A missing return is no proof of free space: black paint and glass return nothing.
    """
    ranges = scan.ranges[scan.hit].astype(np.float64)
    least = max(_TOLERANCE_M, _TOLERANCE_CELLS * resolution)
    tolerances = least + 2.0 * (sigma_m + sigma_rad * np.minimum(ranges, LONGEST_M))
    beams = np.column_stack([yaw + scan.bearings[scan.hit], ranges, tolerances])
    beams[:, 1:] /= resolution
    return beams[tolerances <= max(_MOST_TOLERANCE_M, least)]


def is_new_view(before: SE2, now: SE2) -> bool:
    """Tell whether a robot has moved so far that its scan repeats little of an earlier one."""
    far = before.distance_to(now) >= _NEXT_VIEW_M
    return far or angle_error(before.yaw, now.yaw) >= _NEXT_VIEW_RAD


def day_of(stamp: float) -> int:
    """Return the day of a stamp (s), as the number of days since 1970-01-01, UTC."""
    return math.floor(stamp / _SECONDS_A_DAY)


def _sum(a: NDArray[np.uint16], b: NDArray[np.uint16]) -> NDArray[np.uint16]:
    total: NDArray[np.uint16] = np.minimum(a.astype(np.uint32) + b, 65535).astype(np.uint16)
    return total
