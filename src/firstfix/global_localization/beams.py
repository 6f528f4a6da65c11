"""Which beams of a scan are compared, and how a missing return counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.scan import LaserScan
from firstfix.fields.range_table import DIRECTIONS

# Maps drift over such distances, and farther beams are too few to lose much.
LONGEST_M = 30.0

# Fewer beams on surfaces than this cannot tell places apart, whatever they say.
FEWEST_HITS = 8


@dataclass(frozen=True, eq=False)
class Beams:
    """Beams that say something, in the upright sensor frame.

    Parameters
    ----------
    bearings : ndarray, shape (n,)
        Directions, rad, counter-clockwise.
    ranges : ndarray, shape (n,)
        Distances, m; where nothing returned, the distance that was seen to be free.
    hit : ndarray of bool, shape (n,)
        True where a surface returned the beam.
    """

    bearings: NDArray[np.float64]
    ranges: NDArray[np.float64]
    hit: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.ranges)

    def hits(self) -> Beams:
        """Only the beams that met a surface."""
        return self._take(np.flatnonzero(self.hit))

    def thinned(self, n: int) -> Beams:
        """At most n of the beams, evenly chosen."""
        if len(self) <= n:
            return self
        return self._take(np.linspace(0, len(self) - 1, n).round().astype(np.int64))

    def _take(self, index: NDArray[np.int64]) -> Beams:
        return Beams(self.bearings[index], self.ranges[index], self.hit[index])


def usable_beams(scan: LaserScan, longest_m: float = LONGEST_M) -> Beams:
    """Choose the beams of a scan that say something.

    Parameters
    ----------
    scan : LaserScan
        The scan.
    longest_m : float
        A beam that is longer counts as "nothing up to here", m.

    Returns
    -------
    Beams
        Hits, and beams without a return where the sensor means it (REP 117: +inf).
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
        For each of them the beam of middle length; bearings are those of the table.
    """
    direction = np.rint(beams.bearings / FULL_TURN * DIRECTIONS).astype(np.int64) % DIRECTIONS
    order = np.lexsort((beams.ranges, direction))
    directions, first, count = np.unique(direction[order], return_index=True, return_counts=True)
    middle = order[first + (count - 1) // 2]
    bearings = directions.astype(np.float64) * (FULL_TURN / DIRECTIONS)
    return directions, Beams(bearings, beams.ranges[middle], beams.hit[middle])
