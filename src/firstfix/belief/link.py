"""Whether a scan goes on where the one before ended, or the robot was carried in between.

The map is not asked: in a place that looks like the old one, or where much has changed, it cannot
tell. A robot that drives sees from one scan to the next nearly the same; one that is carried away
sees something else at once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.view import Link, View
from firstfix.core.angles import FULL_TURN
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import Beams, usable_beams

# Of the beams that can be compared, so many agree if the robot has not been carried. On floors 3100
# to 3105 and three sensors, fewer do after 83 to 96 % of the kidnaps, and else only where wheels
# have slipped, by 2 to 11 degrees.
_LEAST_AGREEING = 0.7
# More do in 19 of 20 scans, and after no kidnap there.
_NEARLY_ALL = 0.95

# Then there is a turn after which nearly all beams agree.
_LEAST_AFTER_SLIP = 0.8
_SLIPS_RAD = np.radians([turn for turn in np.arange(-20.0, 21.0, 2.5) if turn])

# Beams agree up to this: noise, people, the turn during a scan.
_SAME_M, _SAME_PER_M = 0.15, 0.03

# With fewer beams, or after a longer way, nothing can be said.
_FEWEST_COMPARED = 20
_MOST_COMPARED = 360
_MOST_M, _MOST_RAD = 0.3, math.radians(15.0)

# Beams of the other scan that enclose a direction; wider gaps are no view.
_NEIGHBOURS = 2
_WIDEST_GAP_RAD = math.radians(5.0)


def link(before: View, now: View) -> Link:
    """Tell whether a view goes on where the one before ended.

    Each end point of one scan is compared with the beams of the other in its direction. Behind
    their ends it may have been hidden; before them they have seen through it.

    Parameters
    ----------
    before, now : View
        In the order of time.

    Returns
    -------
    Link
        UNKNOWN if too little of the views can be compared, or if wheels have slipped.
    """
    step = _short_step(before, now)
    if step is None:
        return Link.UNKNOWN
    if now.unconfirmed is not None and now.unconfirmed == before.unconfirmed:
        return Link.GOES_ON  # laid on each other, the scans have confirmed the step
    share = agreeing(before, now, step)
    if math.isnan(share):
        return Link.UNKNOWN
    if share >= _LEAST_AGREEING:
        return Link.GOES_ON
    slips = (agreeing(before, now, step @ SE2(0.0, 0.0, float(turn))) for turn in _SLIPS_RAD)
    has_slipped = any(slipped >= _LEAST_AFTER_SLIP for slipped in slips)
    return Link.UNKNOWN if has_slipped else Link.BROKEN


def nearly_all_goes_on(before: View, now: View) -> bool:
    """Tell whether so many beams agree that the robot has not been carried to a similar place."""
    step = _short_step(before, now)
    return step is not None and agreeing(before, now, step) >= _NEARLY_ALL


def _short_step(before: View, now: View) -> SE2 | None:
    """Return the step of the odometry, unless it is too long to compare the views."""
    step = before.T_odom_base.inverse() @ now.T_odom_base
    is_long = math.hypot(step.x, step.y) > _MOST_M or abs(step.yaw) > _MOST_RAD
    return None if is_long else step


def agreeing(before: View, now: View, step: SE2) -> float:
    """Return the share of the beams that agree if the base moved so; NaN if too few can."""
    agree = against = 0
    for one, other in zip(before.scans, now.scans, strict=False):
        T_one_other = one.T_base_laser.inverse() @ step @ other.T_base_laser
        for counts in (
            _compare(other, one, T_one_other),
            _compare(one, other, T_one_other.inverse()),
        ):
            agree, against = agree + counts[0], against + counts[1]
    compared = agree + against
    return agree / compared if compared >= _FEWEST_COMPARED else math.nan


def _compare(seen: LaserScan, by: LaserScan, T_by_seen: SE2) -> tuple[int, int]:
    """Count the end points of a scan that another confirms, and those it has seen through."""
    hits, beams = usable_beams(seen).hits().thinned(_MOST_COMPARED), usable_beams(by)
    ends = T_by_seen.apply(hits.ends)
    if len(ends) == 0 or len(beams) < 2 * _NEIGHBOURS:
        return 0, 0
    distance = np.hypot(*ends.T)
    nearest, farthest = _enclosing(np.arctan2(ends[:, 1], ends[:, 0]), beams)
    same = _SAME_M + _SAME_PER_M * distance
    is_through = distance < nearest - same
    is_hidden = distance > farthest + same
    is_seen = np.isfinite(nearest) & (distance < by.range_max)
    agree = is_seen & ~is_through & ~is_hidden
    return int(np.count_nonzero(agree)), int(np.count_nonzero(is_seen & is_through))


def _enclosing(
    bearings: NDArray[np.float64], beams: Beams
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the shortest and the longest beam near each direction; NaN outside the view."""
    around = np.mod(beams.bearings, FULL_TURN)
    order = np.argsort(around, kind="stable")
    around, ranges = around[order], beams.ranges[order]
    at = np.mod(bearings, FULL_TURN)
    right = np.searchsorted(around, at)
    index = (right[:, None] + np.arange(-_NEIGHBOURS, _NEIGHBOURS)) % len(around)
    gap = np.mod(around[index[:, _NEIGHBOURS]] - around[index[:, _NEIGHBOURS - 1]], FULL_TURN)
    near = ranges[index]
    is_inside = gap <= _WIDEST_GAP_RAD
    nearest = np.where(is_inside, near.min(axis=1), math.nan)
    return nearest, np.where(is_inside, near.max(axis=1), math.nan)
