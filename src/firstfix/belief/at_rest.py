"""Several scans of a robot that stands still, as one scan without the people who walk by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from firstfix.core.scan import LaserScan

# Two readings of one surface differ by noise: 5 cm and 1 % of the range.
_NOISE_M = 0.05
_NOISE_SHARE = 0.01

# Missing returns count where they are the rule: a wall of glass shows itself now and then.
_RULE = 0.5


def longest_consistent(scans: Sequence[LaserScan]) -> LaserScan:
    """Keep for each beam the longest range that two of the scans agree on.

    A wall stays where it is; a person who walks shortens a beam for a while.

    Parameters
    ----------
    scans : sequence of LaserScan
        Of one sensor at one place, oldest first; at least one, all with the same beams.

    Returns
    -------
    LaserScan
        The newest scan with these ranges. A beam that agrees with itself nowhere keeps its longest
        reading. Two scans or fewer cannot tell: the longer reading counts.
    """
    newest = scans[-1]
    if len(scans) == 1:
        return newest
    with np.errstate(invalid="ignore"):
        hits = np.array([np.where(scan.hit, scan.ranges, np.nan) for scan in scans], np.float64)
    absent = np.mean([scan.no_return for scan in scans], axis=0)
    ranges = -np.sort(-np.nan_to_num(hits, nan=-1.0), axis=0)  # longest first, invalid ones last
    agrees = ranges[:-1] - ranges[1:] <= _NOISE_M + _NOISE_SHARE * ranges[:-1]
    agrees &= ranges[1:] > 0.0
    first = np.where(agrees.any(axis=0), np.argmax(agrees, axis=0), 0)
    chosen = np.take_along_axis(ranges, first[None], axis=0)[0]
    merged = np.where(chosen > 0.0, chosen, np.nan)
    merged = np.where(absent > _RULE, np.inf, merged)
    merged = np.where(np.isnan(merged) & (absent > 0.0), np.inf, merged)
    return replace(newest, ranges=merged.astype(np.float32))
