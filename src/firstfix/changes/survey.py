"""From counts to changes: walls that are gone, things that are new, space that was not mapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from firstfix.changes.counts import DayCounts
from firstfix.changes.kernels import label_areas
from firstfix.core.errors import InputError
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

# A person who walks by is in a cell in one view or two. A beam may slip through a wall once.
FEWEST_VIEWS = 3
_GONE_SHARE = 0.8
_NEW_SHARE = 0.5
_RIM_SHARE = 0.25

# Smaller areas are noise: two cells of a leg of a table are 0.005 m² at 5 cm.
LEAST_AREA_M2 = 0.02
_GAP_M = 0.1


class Change(IntEnum):
    """How a cell differs from the map.

    Examples
    --------
    >>> ff.Change.GONE.words
    'walls that are gone'
    """

    NONE = 0
    GONE = 1
    NEW = 2
    FOUND_WALL = 3
    FOUND_FREE = 4

    @property
    def words(self) -> str:
        """For people."""
        return {
            Change.NONE: "as in the map",
            Change.GONE: "walls that are gone",
            Change.NEW: "things that are new",
            Change.FOUND_WALL: "walls seen in unknown space",
            Change.FOUND_FREE: "free floor seen in unknown space",
        }[self]


@dataclass(frozen=True, slots=True)
class Area:
    """Connected cells with one change.

    Parameters
    ----------
    change : Change
        How they differ from the map.
    area_m2 : float
        Their area, m².
    x, y : float
        The cell of the area nearest to its middle, map frame, m.
    width_m, height_m : float
        Sides of its box along the axes of the grid, m.
    views : int
        Median number of views of its cells on the newest day.
    days : int
        Most days on which one of its cells had this change.
    """

    change: Change
    area_m2: float
    x: float
    y: float
    width_m: float
    height_m: float
    views: int
    days: int


@dataclass(frozen=True, eq=False)
class MapChanges:
    """The changes of a map, by the newest day that saw each cell.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    kinds : ndarray of uint8, shape (height, width)
        A `Change` per cell.
    days : ndarray of uint8, shape (height, width)
        On how many days the cell had this change; 0 where there is none.
    areas : tuple of Area
        Connected areas, the largest first.
    dates : tuple of str
        The days, YYYY-MM-DD, oldest first.
    views : int
        Number of views of all days.

    Examples
    --------
    >>> counter = ff.ChangeCounter(ff.ScanMatcher(grid).fields)
    >>> ff.find_changes(grid, counter.days).area_m2(ff.Change.NEW)
    0.0
    """

    grid: OccupancyGrid
    kinds: NDArray[np.uint8]
    days: NDArray[np.uint8]
    areas: tuple[Area, ...]
    dates: tuple[str, ...]
    views: int

    def area_m2(self, change: Change) -> float:
        """Return the area with one change, m²."""
        return float(np.count_nonzero(self.kinds == change)) * self.grid.resolution**2

    def redrawn(self) -> OccupancyGrid:
        """Return the map with the changes applied, for the person who redraws it."""
        return self._with_changes(self.grid.cells.copy())

    def layer(self) -> OccupancyGrid:
        """Return the changes alone, unknown elsewhere, for a planner that adds maps."""
        return self._with_changes(np.full_like(self.grid.cells, UNKNOWN))

    def _with_changes(self, cells: NDArray[np.int8]) -> OccupancyGrid:
        cells[np.isin(self.kinds, (Change.NEW, Change.FOUND_WALL))] = OCCUPIED
        cells[np.isin(self.kinds, (Change.GONE, Change.FOUND_FREE))] = FREE
        return OccupancyGrid(cells, self.grid.resolution, self.grid.T_map_grid)


def find_changes(
    grid: OccupancyGrid, days: Sequence[DayCounts], fewest_days: int = 1
) -> MapChanges:
    """Compare the counts of some days with a map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map in which they were counted.
    days : sequence of DayCounts
        In any order, each day once.
    fewest_days : int
        A change that was seen on fewer days is left out: something may have been put down.

    Returns
    -------
    MapChanges
        Areas below `LEAST_AREA_M2` are left out.

    Raises
    ------
    InputError
        If the counts belong to a map of another size, or a day is there twice.

    Examples
    --------
    >>> counter = ff.ChangeCounter(ff.ScanMatcher(grid).fields)
    >>> ff.find_changes(grid, counter.days).areas
    ()
    """
    ordered = sorted(days, key=lambda counts: counts.day)
    _check(grid, ordered)
    kinds = np.zeros(grid.cells.shape, np.uint8)
    seen_on = np.zeros(grid.cells.shape, np.uint8)
    views = np.zeros(grid.cells.shape, np.uint32)
    for counts in ordered:
        of_day, observed = kinds_of_day(grid, counts)
        is_seen = observed >= FEWEST_VIEWS
        continues = is_seen & (of_day == kinds)
        seen_on[continues & (seen_on < 255)] += 1
        seen_on[is_seen & ~continues] = 1
        kinds[is_seen] = of_day[is_seen]
        views[is_seen] = observed[is_seen]
    kinds[seen_on < fewest_days] = Change.NONE
    seen_on[kinds == Change.NONE] = 0
    areas = _areas(grid, kinds, seen_on, views)
    return MapChanges(
        grid=grid,
        kinds=kinds,
        days=seen_on,
        areas=areas,
        dates=tuple(counts.date for counts in ordered),
        views=sum(counts.views for counts in ordered),
    )


def kinds_of_day(
    grid: OccupancyGrid, counts: DayCounts
) -> tuple[NDArray[np.uint8], NDArray[np.uint32]]:
    """Return the `Change` of each cell by one day alone, and in how many views it was seen."""
    near, passes = counts.near.astype(np.uint32), counts.passes.astype(np.uint32)
    observed = near + passes
    kinds = np.zeros(grid.cells.shape, np.uint8)
    is_passed = (passes >= FEWEST_VIEWS) & (passes >= _GONE_SHARE * observed)
    # Hits of one surface scatter over neighbours. Those that are hit little are its rim.
    is_hit = (near >= FEWEST_VIEWS) & (near >= _NEW_SHARE * observed)
    is_hit &= (counts.hits >= 2) & (counts.hits >= _RIM_SHARE * near)
    kinds[grid.occupied & is_passed] = Change.GONE
    kinds[grid.seen_free & is_hit] = Change.NEW
    kinds[grid.unknown & is_hit] = Change.FOUND_WALL
    kinds[grid.unknown & is_passed] = Change.FOUND_FREE
    return kinds, observed


def _check(grid: OccupancyGrid, ordered: Sequence[DayCounts]) -> None:
    for counts in ordered:
        if counts.hits.shape != grid.cells.shape:
            raise InputError(
                expected=f"counts of a map of {grid.width} x {grid.height} cells",
                received=f"counts of {counts.hits.shape[1]} x {counts.hits.shape[0]} cells",
                remedy="use the map in which they were counted",
            )
    numbers = [counts.day for counts in ordered]
    if len(set(numbers)) < len(numbers):
        raise InputError("One day is there twice. Merge its counts with merged_with first.")


def _areas(
    grid: OccupancyGrid,
    kinds: NDArray[np.uint8],
    days: NDArray[np.uint8],
    views: NDArray[np.uint32],
) -> tuple[Area, ...]:
    """List the areas, and clear those in ``kinds`` and ``days`` that are too small."""
    labels = np.zeros(kinds.shape, np.int32)
    gap = max(1, round(_GAP_M / grid.resolution))
    # A cell is pushed once.
    label_areas(kinds, gap, labels, np.empty(1 + int(np.count_nonzero(kinds)), np.int64))
    cells = np.flatnonzero(labels)
    order = np.argsort(labels.flat[cells], kind="stable")
    cells = cells[order]
    starts = np.flatnonzero(np.diff(labels.flat[cells], prepend=0))
    areas = []
    for members in np.split(cells, starts[1:]) if len(cells) else ():
        if len(members) * grid.resolution**2 < LEAST_AREA_M2:
            kinds.flat[members] = Change.NONE
            days.flat[members] = 0
            continue
        areas.append(_area(grid, members, kinds, days, views))
    return tuple(sorted(areas, key=lambda area: (-area.area_m2, area.x, area.y)))


def _area(
    grid: OccupancyGrid,
    members: NDArray[np.intp],
    kinds: NDArray[np.uint8],
    days: NDArray[np.uint8],
    views: NDArray[np.uint32],
) -> Area:
    rows, columns = np.divmod(members, grid.width)
    off = np.hypot(rows - rows.mean(), columns - columns.mean())
    nearest = int(off.argmin())
    x, y = grid.to_map(np.array([columns[nearest] + 0.5, rows[nearest] + 0.5]))
    return Area(
        change=Change(int(kinds.flat[members[0]])),
        area_m2=len(members) * grid.resolution**2,
        x=float(x),
        y=float(y),
        width_m=float(np.ptp(columns) + 1) * grid.resolution,
        height_m=float(np.ptp(rows) + 1) * grid.resolution,
        views=int(np.median(views.flat[members])),
        days=int(days.flat[members].max()),
    )
