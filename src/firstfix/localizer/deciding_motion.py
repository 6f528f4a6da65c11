"""Which motion is expected to decide between several places."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.global_localization.verdict import EXPONENT, RIVAL_SHARE, log_likelihoods
from firstfix.localizer.outputs import MotionRequest

FARTHEST_M = 3.0
"""Longest drive that is considered, m."""

_TURNS = tuple(math.radians(degrees) for degrees in (0, 45, -45, 90, -90, 135, -135, 180))
_AHEAD_M = (0.0, 1.0, 2.0, FARTHEST_M)
_PLACES = 8
_BEAMS = 48
_REACH_M = 30.0

# A beam differs between two places if its ranges there differ by more than maps are precise, m.
# Such beams cost about as much as one that sees through a wall; all others as much as usual, nats.
_DIFFERENT_M = 0.3
_DIFFERENT_COST = 3.0
_USUAL_COST = 0.3

# A motion must remove this fraction of the entropy, and every metre costs so much of it.
_LEAST_FRACTION = 0.1
_FRACTION_PER_M = 0.02

# A view counts as a second one from 15 degrees on.
_SECOND_LOOK_RAD = math.radians(20.0)

# Space that a robot needs on its way, in front and at its sides.
_ROOM_M = 0.5
_SIDES_RAD = (-0.3, 0.0, 0.3)


def deciding_motion(
    scans: Scans, places: Sequence[Hypothesis], grid: OccupancyGrid
) -> MotionRequest | None:
    """Find the motion that reduces the expected entropy over the places most.

    Parameters
    ----------
    scans : LaserScan or sequence of LaserScan
        The scan, or one of each sensor, that left the places open. They have the fields of view and
        ranges of the sensors.
    places : sequence of Hypothesis
        Most likely first; the first eight that are rivals of the best are compared.
    grid : OccupancyGrid
        The map.

    Returns
    -------
    MotionRequest or None
        A turn and a drive that is free of walls at all of these places. None if no motion of up to
        `FARTHEST_M` is worth it: the places look identical to this sensor from all over there.
    """
    if len(places) < 2:
        return None
    scans = as_scans(scans)
    rivals = [p for p in places[:_PLACES] if p.probability >= RIVAL_SHARE * places[0].probability]
    poses = [place.pose for place in rivals]
    weights = np.array([place.probability for place in rivals])
    weights /= weights.sum()
    now = _entropy(weights)
    # What the map expects to differ already here, the scan has not decided.
    here = _expected_entropy(_views(scans, poses, SE2.identity(), grid), weights)
    best, best_worth = None, -math.inf
    for turn in _TURNS:
        room = min(_room_ahead(grid, pose, turn) for pose in poses)
        for ahead in _AHEAD_M:
            if ahead > 0.0 and room < ahead + _ROOM_M:
                continue
            T_base_moved = SE2(0.0, 0.0, turn) @ SE2(ahead, 0.0, 0.0)
            gain = here - _expected_entropy(_views(scans, poses, T_base_moved, grid), weights)
            worth = gain - _FRACTION_PER_M * ahead * now
            if gain > _LEAST_FRACTION * now and worth > best_worth:
                best, best_worth = MotionRequest(_stamp(scans), turn, ahead, gain), worth
    return best


def advise(
    scans: Scans, places: Sequence[Hypothesis], rivals: int, grid: OccupancyGrid
) -> tuple[str, MotionRequest | None]:
    """Say what the choice between the places needs.

    Parameters
    ----------
    scans, places, grid
        As in `deciding_motion`.
    rivals : int
        Number of places that fit about equally well.

    Returns
    -------
    str
        In words; empty if only one place is left, which a second look can confirm.
    MotionRequest or None
        The motion.
    """
    if rivals <= 1:
        return "", MotionRequest(_stamp(as_scans(scans)), _SECOND_LOOK_RAD, 0.0, 0.0)
    motion = deciding_motion(scans, places, grid)
    if motion is not None:
        return f"{rivals} places fit about equally well; motion would decide", motion
    identical = f"{rivals} places look identical to this sensor"
    return f"{identical}; no motion of up to {FARTHEST_M:.0f} m would decide", None


def _room_ahead(grid: OccupancyGrid, T_map_base: SE2, turn: float) -> float:
    bearings = turn + np.array(_SIDES_RAD)
    return float(expected_ranges(grid, T_map_base, bearings, FARTHEST_M + 1.0).min())


def _stamp(scans: tuple[LaserScan, ...]) -> float:
    return max(scan.stamp for scan in scans)


def _views(
    scans: tuple[LaserScan, ...], poses: Sequence[SE2], T_base_moved: SE2, grid: OccupancyGrid
) -> NDArray[np.float64]:
    """Return the ranges expected of all sensors after a motion, shape (places, beams), m."""
    return np.concatenate([_view(scan, poses, T_base_moved, grid) for scan in scans], axis=1)


def _view(
    scan: LaserScan, poses: Sequence[SE2], T_base_moved: SE2, grid: OccupancyGrid
) -> NDArray[np.float64]:
    chosen = np.linspace(0, len(scan) - 1, min(_BEAMS, len(scan))).round().astype(np.int64)
    reach = min(scan.range_max, _REACH_M)
    T_base_laser = T_base_moved @ scan.T_base_laser
    bearings = scan.bearings[chosen]
    views = [expected_ranges(grid, pose @ T_base_laser, bearings, reach) for pose in poses]
    return np.minimum(views, reach)


def _expected_entropy(views: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    """Return the mean entropy after one view, over the places where the robot may be, nats."""
    differs = np.abs(views[:, None] - views[None]) > _DIFFERENT_M
    costs = _USUAL_COST + _DIFFERENT_COST * differs.mean(axis=2)
    logs = log_likelihoods(costs, EXPONENT)
    posterior = weights * np.exp(logs - logs.max(axis=1, keepdims=True))
    posterior /= posterior.sum(axis=1, keepdims=True)
    return float(sum(w * _entropy(row) for w, row in zip(weights, posterior, strict=True)))


def _entropy(probabilities: NDArray[np.float64]) -> float:
    positive = probabilities[probabilities > 0.0]
    return float(-(positive * np.log(positive)).sum())
