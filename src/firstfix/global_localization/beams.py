"""Selection of the beams that are compared, and the meaning of a missing return."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.scan import LaserScan
from firstfix.fields.range_table import DIRECTIONS

# Maps drift over longer distances, and few beams are longer.
LONGEST_M = 30.0

# Fewer hits than this cannot distinguish places.
FEWEST_HITS = 8

# The search grid cannot tell sensors apart that are this near to each other.
_ONE_ORIGIN_M = 0.1


@dataclass(frozen=True, eq=False)
class Beams:
    """Valid beams in the upright sensor frame, or those of several sensors in the frame of one.

    Parameters
    ----------
    bearings : ndarray, shape (n,)
        Directions, rad, counter-clockwise.
    ranges : ndarray, shape (n,)
        Distances, m; without a return the distance that is free.
    hit : ndarray of bool, shape (n,)
        True where a surface returned the beam.
    origins : ndarray, shape (n, 2), or None
        Where the beams begin, m; None where all begin at the origin of the frame.
    turns : float
        How many times the sensors look to all sides, together: 1.5 for two of 270°.
    """

    bearings: NDArray[np.float64]
    ranges: NDArray[np.float64]
    hit: NDArray[np.bool_]
    origins: NDArray[np.float64] | None = None
    turns: float = 1.0

    def __len__(self) -> int:
        return len(self.ranges)

    @cached_property
    def starts(self) -> NDArray[np.float64]:
        """Where the beams begin, shape (n, 2), m."""
        return np.zeros((len(self), 2)) if self.origins is None else self.origins

    @property
    def ends(self) -> NDArray[np.float64]:
        """Where the beams end, shape (n, 2), m."""
        directions = np.column_stack([np.cos(self.bearings), np.sin(self.bearings)])
        ends: NDArray[np.float64] = self.starts + self.ranges[:, None] * directions
        return ends

    def hits(self) -> Beams:
        """Return only the beams that a surface returned."""
        return self.take(np.flatnonzero(self.hit))

    def from_origin(self) -> Beams:
        """Return only the beams that begin at the origin, to the precision of the search."""
        if self.origins is None:
            return self
        return self.take(np.flatnonzero(np.hypot(*self.origins.T) <= _ONE_ORIGIN_M))

    def thinned(self, n: int) -> Beams:
        """Return at most n of the beams, evenly chosen."""
        if len(self) <= n:
            return self
        return self.take(np.linspace(0, len(self) - 1, n).round().astype(np.int64))

    def take(self, index: NDArray[np.int64]) -> Beams:
        """Return the beams of these indices."""
        origins = None if self.origins is None else self.origins[index]
        bearings, ranges, hit = self.bearings[index], self.ranges[index], self.hit[index]
        return Beams(bearings, ranges, hit, origins, self.turns)


def usable_beams(scan: LaserScan, longest_m: float = LONGEST_M) -> Beams:
    """Select the valid beams of a scan.

    Parameters
    ----------
    scan : LaserScan
        The scan.
    longest_m : float
        A longer beam counts as free up to here, m.

    Returns
    -------
    Beams
        Hits, and beams that the sensor reports as free up to its range limit (REP 117: +inf).
    """
    free_to = min(scan.range_max, longest_m)
    hit = scan.hit & (scan.ranges < free_to)
    used = scan.hit | scan.no_return
    ranges = np.where(hit, scan.ranges, free_to).astype(np.float64)
    return Beams(scan.bearings[used], ranges[used], hit[used])


def by_direction(beams: Beams) -> tuple[NDArray[np.int64], Beams]:
    """Bring a scan to the directions of the range table.

    Parameters
    ----------
    beams : Beams
        Beams at any bearings.

    Returns
    -------
    directions : ndarray of int64, shape (m,)
        Directions of the table that the scan has beams in, ascending.
    beams : Beams
        For each of them the beam of median length; bearings are those of the table.
    """
    direction = np.rint(beams.bearings / FULL_TURN * DIRECTIONS).astype(np.int64) % DIRECTIONS
    order = np.lexsort((beams.ranges, direction))
    directions, first, count = np.unique(direction[order], return_index=True, return_counts=True)
    middle = order[first + (count - 1) // 2]
    bearings = directions.astype(np.float64) * (FULL_TURN / DIRECTIONS)
    return directions, Beams(bearings, beams.ranges[middle], beams.hit[middle])
