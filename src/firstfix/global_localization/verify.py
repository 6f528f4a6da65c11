"""The cost of a scan at a pose, and the class of each beam, by ray casting."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.fields.kernel_cache import kernel, part
from firstfix.fields.map_fields import MapFields
from firstfix.fields.raycast import cast_ray_leaping
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.frames import to_map

BEAMS = 180
"""Most beams of a scan that are compared, evenly chosen."""

# Distribution of end points around a wall: 0.1 m of map and pose error, and some outliers.
_SIGMA_M = 0.1
_INLIER, _OUTLIER = 0.96, 0.02

# A beam that passes a wall by more than this goes through it; that costs as much as six beams that
# end a little off. Where walls are drawn too thick, a beam along one is long in it but not deep.
# People and moved chairs make beams short, so a short beam costs little.
_THROUGH_M = 0.3
_THROUGH_COST = 2.0
_THROUGH_LIMIT_M = 1.0
_SHORT_LIMIT_M = 0.4
_INSIDE_WALL_COST = 6.0

# A beam that meets a cell known to have changed says little: it contradicts a pose by this at most.
# docs/decisions/0025 has the measurements.
_CHANGED_COST = 1.2
# A ray ends on the side of a wall; its cell is a little farther.
_IN_WALL_CELLS = 0.1

# A missing return may be glass or black paint: half the weight of a hit.
_NO_RETURN_WEIGHT = 0.5

# Distance from the walls that an end point outside the map is given: an outlier.
_FAR_M = 10.0

# An end point this near to a wall is explained by it.
_EXPLAINED_M = 0.2


class BeamClass(IntEnum):
    """How a beam agrees with the map: the shares of `Evidence`, in their order."""

    EXPLAINED = 0
    SHORT = 1
    THROUGH_WALL = 2
    UNKNOWN = 3

    @property
    def label(self) -> str:
        """The words for people."""
        return _LABELS[self]


_LABELS = (
    "explained by the map",
    "short of a wall: people, furniture",
    "through a wall",
    "in unknown space",
)

_NO_DETAILS = np.empty((0, 0, 2))

# As kernels take them.
_EXPLAINED, _SHORT, _THROUGH, _UNKNOWN = (int(kind) for kind in BeamClass)


@dataclass(frozen=True, eq=False)
class Verification:
    """Costs and evidence of several poses.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the sensor in the grid.
    scores : ndarray, shape (n,)
        Weighted mean cost of a beam, nats; lower is better.
    counts : ndarray of int64, shape (n, 4)
        Beams explained, short, through a wall, in unknown space.
    """

    poses: NDArray[np.float64]
    scores: NDArray[np.float64]
    counts: NDArray[np.int64]

    def evidence(self, i: int) -> Evidence:
        """Shares of beams at pose i."""
        total = int(self.counts[i].sum())
        explained, short, through, unknown = (self.counts[i] / max(1, total)).tolist()
        return Evidence(explained, short, through, unknown, total)


def verify(poses: NDArray[np.float64], beams: Beams, fields: MapFields) -> Verification:
    """Compare a scan with what the map predicts at each pose.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the sensor in the grid.
    beams : Beams
        The scan.
    fields : MapFields
        The prepared map.

    Returns
    -------
    Verification
        Poses with costs and evidence, in their order.
    """
    scores, counts, _ = _compared(poses, beams.thinned(BEAMS), fields)
    return Verification(poses, scores, counts)


def beam_costs(
    poses: NDArray[np.float64], beams: Beams, fields: MapFields
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what each beam adds to the mean cost of a scan, and how far away the cause is.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the sensor in the grid.
    beams : Beams
        The scan.
    fields : MapFields
        The prepared map.

    Returns
    -------
    costs : ndarray, shape (n, len(beams))
        Nats; a row sums to the score of `verify`.
    causes : ndarray, shape (n, len(beams))
        Distance from the sensor to the thing that was measured or to the wall that was expected,
        whichever is nearer, m.
    """
    details = np.zeros((len(poses), len(beams), 2))
    details[..., 0] = _INSIDE_WALL_COST / max(1, len(beams))
    _compared(poses, beams, fields, details)
    return details[..., 0], details[..., 1]


def verified_place(
    grid: OccupancyGrid,
    scan: LaserScan,
    verification: Verification,
    i: int,
    covariance: NDArray[np.float64],
    probability: float,
) -> Hypothesis:
    """Return the hypothesis for a verified pose.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Knows where the sensor sits.
    verification : Verification
        Of several poses.
    i : int
        Which of them it is.
    covariance : ndarray, shape (3, 3)
        Of x, y (cells), heading (rad) of the sensor in the grid.
    probability : float
        That it is the right place, 0 to 1.

    Returns
    -------
    Hypothesis
        For ``T_map_base``.
    """
    return Hypothesis(
        *to_map(grid, scan, verification.poses[i], covariance),
        score=float(verification.scores[i]),
        probability=probability,
        evidence=verification.evidence(i),
    )


def beam_classes(pose: NDArray[np.float64], beams: Beams, fields: MapFields) -> NDArray[np.uint8]:
    """Classify each beam of a scan at one pose.

    Parameters
    ----------
    pose : ndarray, shape (3,)
        x, y (cells), heading (rad) of the sensor in the grid.
    beams : Beams
        The scan.
    fields : MapFields
        The prepared map.

    Returns
    -------
    ndarray of uint8, shape (len(beams),)
        Values of `BeamClass`.
    """
    _, _, classes = _compared(pose[None], beams, fields)
    return classes.reshape(-1)


def beam_weights(beams: Beams) -> NDArray[np.float64]:
    """Return the weight of each beam in the mean cost, shape (n,); their sum is 1."""
    # Neighbouring beams on a near wall are redundant, far beams are not. The root lies between the
    # same weight for every beam and the same weight for every metre of wall.
    weights: NDArray[np.float64] = np.sqrt(beams.ranges)
    weights *= np.where(beams.hit, 1.0, _NO_RETURN_WEIGHT)
    weights /= weights.sum()
    return weights


def _compared(
    poses: NDArray[np.float64],
    used: Beams,
    fields: MapFields,
    details: NDArray[np.float64] = _NO_DETAILS,
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.uint8]]:
    """Return scores (n,), counts (n, 4), classes (n, beams); fill details (n, beams, 2)."""
    weights = beam_weights(used)
    scores = np.empty(len(poses))
    counts = np.zeros((len(poses), 4), np.int64)
    classes = np.empty((len(poses), len(used)), np.uint8)
    _verify(
        poses,
        used.starts / fields.grid.resolution,
        np.cos(used.bearings),
        np.sin(used.bearings),
        used.ranges,
        used.hit,
        weights,
        fields.clearance,
        fields.squares,
        fields.distances * np.float32(fields.grid.resolution),
        fields.unknown,
        fields.changed,
        fields.grid.resolution,
        scores,
        counts,
        classes,
        details,
    )
    return scores, counts, classes


@part
def _meets(
    cells: NDArray[np.bool_],
    start: tuple[float, float],
    direction: tuple[float, float],
    lengths: tuple[float, float],
) -> bool:
    """Tell whether a cell is true at one of two lengths (cells) along a beam."""
    height, width = cells.shape
    for length in lengths:
        column = math.floor(start[0] + length * direction[0])
        row = math.floor(start[1] + length * direction[1])
        if 0 <= column < width and 0 <= row < height and cells[row, column]:
            return True
    return False


@part
def _is_shallow(
    squares: NDArray[np.uint16],
    clearance: NDArray[np.uint8],
    start: tuple[float, float],
    direction: tuple[float, float],
    stretch: tuple[float, float],
    deepest: float,
) -> bool:
    """Tell whether a beam stays in the wall that it enters, not far from its visible side.

    The stretch from the entry to the end of the beam, and the depth across it, are cells.
    """
    height, width = squares.shape
    length = stretch[1]
    while length > stretch[0]:
        x, y = start[0] + length * direction[0], start[1] + length * direction[1]
        if squares[math.floor(y), math.floor(x)] != 0:
            return False
        length -= 1.0
    for side in (-deepest, deepest):
        across_x = stretch[1] * direction[0] - side * direction[1]
        across_y = stretch[1] * direction[1] + side * direction[0]
        away = math.sqrt(across_x * across_x + across_y * across_y)
        column, row = math.floor(start[0] + across_x), math.floor(start[1] + across_y)
        if 0 <= column < width and 0 <= row < height and squares[row, column] != 0:
            seen = cast_ray_leaping(
                clearance, start[0], start[1], across_x / away, across_y / away, away
            )
            if seen >= away:
                return True
    return False


@part
def _note(details: NDArray[np.float64], k: int, i: int, cost: float, cause: float) -> None:
    """Keep the cost of one beam and the distance of its cause, unless `details` is empty."""
    if details.size > 0:
        details[k, i, 0], details[k, i, 1] = cost, cause


@kernel
def _verify(  # noqa: PLR0913 - a kernel takes its arrays one by one
    poses: NDArray[np.float64],
    starts: NDArray[np.float64],
    cosines: NDArray[np.float64],
    sines: NDArray[np.float64],
    ranges: NDArray[np.float64],
    hit: NDArray[np.bool_],
    weights: NDArray[np.float64],
    clearance: NDArray[np.uint8],
    squares: NDArray[np.uint16],
    distances_m: NDArray[np.float32],
    unknown: NDArray[np.bool_],
    changed: NDArray[np.bool_],
    resolution: float,
    scores: NDArray[np.float64],
    counts: NDArray[np.int64],
    classes: NDArray[np.uint8],
    details: NDArray[np.float64],
) -> None:
    height, width = squares.shape
    for k in range(poses.shape[0]):
        cost = 0.0
        cos, sin = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        column, row = math.floor(poses[k, 0]), math.floor(poses[k, 1])
        if 0 <= column < width and 0 <= row < height and clearance[row, column] == 0:
            # A sensor cannot stand in a wall, although very short beams would fit there.
            scores[k] = _INSIDE_WALL_COST
            counts[k, _THROUGH] = ranges.shape[0]
            classes[k] = _THROUGH
            continue
        for i in range(ranges.shape[0]):
            dx = cos * cosines[i] - sin * sines[i]
            dy = sin * cosines[i] + cos * sines[i]
            start_x = poses[k, 0] + (cos * starts[i, 0] - sin * starts[i, 1])
            start_y = poses[k, 1] + (sin * starts[i, 0] + cos * starts[i, 1])
            reach = ranges[i] + (_SHORT_LIMIT_M if hit[i] else 0.0)
            expected = resolution * cast_ray_leaping(
                clearance, start_x, start_y, dx, dy, reach / resolution
            )
            gap = ranges[i] - expected
            x = math.floor(start_x + ranges[i] / resolution * dx)
            y = math.floor(start_y + ranges[i] / resolution * dy)
            inside = 0 <= x < width and 0 <= y < height
            through = gap > _THROUGH_M
            if through and hit[i] and inside and squares[y, x] == 0:
                through = not _is_shallow(
                    squares,
                    clearance,
                    (start_x, start_y),
                    (dx, dy),
                    (expected / resolution, ranges[i] / resolution),
                    _THROUGH_M / resolution,
                )
            differs = min(gap, _THROUGH_LIMIT_M) if gap > 0.0 else min(-gap, _SHORT_LIMIT_M)
            if through:
                differs += _THROUGH_COST
            if not hit[i]:
                classes[k, i] = _THROUGH if through else _EXPLAINED
            else:
                distance = distances_m[squares[y, x]] if inside else _FAR_M
                near = math.exp(-0.5 * (distance / _SIGMA_M) ** 2)
                differs -= math.log(_INLIER * near + _OUTLIER)
                if through:
                    classes[k, i] = _THROUGH
                elif distance <= _EXPLAINED_M:
                    classes[k, i] = _EXPLAINED
                elif not inside or unknown[y, x]:
                    classes[k, i] = _UNKNOWN
                else:
                    classes[k, i] = _SHORT
            if changed.size > 0 and differs > _CHANGED_COST:
                wall = expected if expected < reach else ranges[i]
                lengths = (ranges[i] / resolution, wall / resolution + _IN_WALL_CELLS)
                if _meets(changed, (start_x, start_y), (dx, dy), lengths):
                    differs, classes[k, i] = _CHANGED_COST, _UNKNOWN
            cost += weights[i] * differs
            _note(details, k, i, weights[i] * differs, min(ranges[i], expected))
            counts[k, classes[k, i]] += 1
        scores[k] = cost
