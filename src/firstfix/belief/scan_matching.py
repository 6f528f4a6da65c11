"""Two scans laid on each other: how well they agree after a step, and after which they agree best.

Censi, "An ICP variant using a point-to-line metric" (ICRA 2008), with a cost that is bounded, so
that people and what has just come into view count little.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.scan import LaserScan
from firstfix.fields.kernel_cache import kernel
from firstfix.global_localization.beams import usable_beams

# At this distance from a wall of the other scan an end point costs half of the most. Large errors
# are cured with the coarse distance first; end points farther off than the gate cost the most.
_FINE_M, _COARSE_M = 0.05, 0.2
_FINE_GATE_M, _COARSE_GATE_M = 0.25, 0.5
_COARSE_ROUNDS, _ROUNDS = 8, 16
_SETTLED = 1e-3

# Where walls fix no direction the start does: its weight against that of a beam.
_WEIGHT_OF_START = 0.0005

_BEAMS = 120
_FEWEST_COMPARED = 30

# A wall goes on to the next end point if that is not farther away than this, or so many beams.
_ONE_WALL_M, _ONE_WALL_BEAMS = 0.15, 4.0
# End points on each side that give a wall its direction.
_NEIGHBOURS = 3
_SHORTEST_M = 1e-6
# A wider gap between two beams is no view.
_WIDEST_GAP_RAD = math.radians(5.0)
# End points in directions farther off are not looked at.
_FARTHEST_OFF_RAD = 1.5


@dataclass(frozen=True, eq=False)
class _Walls:
    """End points of a scan in the base frame, by their direction from the sensor.

    Shapes: ends (n, 2), bearings (n,), ranges (n,), normals (n, 2), origin (2,), the sensor. The
    normal is zero where a scan has no wall but single points, such as far along a corridor. They
    are not compared: points of the same bearings agree best if the robot has not moved.
    """

    ends: NDArray[np.float64]
    bearings: NDArray[np.float64]
    ranges: NDArray[np.float64]
    normals: NDArray[np.float64]
    origin: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Agreement:
    """How two scans agree after a step.

    Parameters
    ----------
    cost : float
        Mean cost of an end point, 0 to 1; NaN if too few can be compared.
    information : ndarray, shape (3, 3)
        What an end point says of x (m), y (m), yaw (rad) of the step; 1 is that of a beam that hits
        a wall at a right angle.
    """

    cost: float
    information: NDArray[np.float64]

    @cached_property
    def weakest(self) -> tuple[float, NDArray[np.float64]]:
        """How well the step is held where it slides most easily, 0 to 0.5, and along what, (2,)."""
        if not self.information[2, 2] > 0.0:
            return 0.0, np.array([1.0, 0.0])
        turning = self.information[:2, 2]
        sliding = self.information[:2, :2] - np.outer(turning, turning) / self.information[2, 2]
        held, directions = np.linalg.eigh(sliding)
        return float(held[0]), directions[:, 0]


class ScanPair:
    """The scans of two times, those of each sensor side by side.

    Parameters
    ----------
    before, now : sequence of LaserScan
        In the order of time.
    """

    def __init__(self, before: Sequence[LaserScan], now: Sequence[LaserScan]) -> None:
        self._pairs = [
            (_end_points(new), _walls(old)) for old, new in zip(before, now, strict=False)
        ]

    def agreement(self, step: NDArray[np.float64]) -> Agreement:
        """Compare the scans, if the base made this step: x (m), y (m), yaw (rad), shape (3,)."""
        cost, count, _, curvature = self._compare(step, _FINE_GATE_M, _FINE_M)
        if count < _FEWEST_COMPARED:
            return Agreement(math.nan, np.zeros((3, 3)))
        return Agreement(cost / count, curvature / count)

    def match(self, starts: Iterable[NDArray[np.float64]]) -> tuple[NDArray[np.float64], Agreement]:
        """Return the best step near one of several others, and how the scans agree after it."""
        steps = [self._settled(start) for start in starts]
        found = [(step, self.agreement(step)) for step in steps]
        return min(found, key=lambda each: math.inf if math.isnan(each[1].cost) else each[1].cost)

    def _settled(self, start: NDArray[np.float64]) -> NDArray[np.float64]:
        step = start.copy()
        for i in range(_ROUNDS):
            coarse = i < _COARSE_ROUNDS
            gate, sigma = (_COARSE_GATE_M, _COARSE_M) if coarse else (_FINE_GATE_M, _FINE_M)
            _, count, gradient, curvature = self._compare(step, gate, sigma)
            if count < _FEWEST_COMPARED:
                return start
            weight = _WEIGHT_OF_START * count
            gradient += weight * (step - start)
            change = np.linalg.solve(curvature + weight * np.eye(3), gradient)
            step -= change
            if not coarse and np.abs(change).max() < _SETTLED:
                break
        return step

    def _compare(
        self, step: NDArray[np.float64], gate: float, sigma: float
    ) -> tuple[float, int, NDArray[np.float64], NDArray[np.float64]]:
        cost, count, gradient, curvature = 0.0, 0, np.zeros(3), np.zeros((3, 3))
        for points, walls in self._pairs:
            if len(points) == 0 or len(walls.ends) == 0:
                continue
            arrays = (walls.ends, walls.bearings, walls.ranges, walls.normals, walls.origin)
            more, compared = _add_points(step, points, arrays, gate, sigma, gradient, curvature)
            cost, count = cost + more, count + compared
        return cost, count, gradient, curvature


def _end_points(scan: LaserScan) -> NDArray[np.float64]:
    return scan.T_base_laser.apply(usable_beams(scan).hits().thinned(_BEAMS).ends)


def _walls(scan: LaserScan) -> _Walls:
    hits = usable_beams(scan).hits()
    origin = np.array([scan.T_base_laser.x, scan.T_base_laser.y])
    ends = scan.T_base_laser.apply(hits.ends)
    bearings = np.arctan2(ends[:, 1] - origin[1], ends[:, 0] - origin[0])
    order = np.argsort(bearings, kind="stable")
    ends, bearings, ranges = ends[order], bearings[order], hits.ranges[order]
    farthest = np.maximum(_ONE_WALL_M, _ONE_WALL_BEAMS * abs(scan.angle_increment) * ranges)
    return _Walls(ends, bearings, ranges, _normals(ends, farthest), origin)


@kernel
def _normals(ends: NDArray[np.float64], farthest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the normal of the wall through each end point and its neighbours, shape (n, 2)."""
    n = len(ends)
    normals = np.zeros((n, 2))
    for i in range(n):
        first = last = i
        for _ in range(_NEIGHBOURS):
            left = (last + 1) % n
            gap = math.hypot(ends[left, 0] - ends[last, 0], ends[left, 1] - ends[last, 1])
            if gap >= farthest[last]:
                break
            last = left
        for _ in range(_NEIGHBOURS):
            right = (first - 1) % n
            gap = math.hypot(ends[right, 0] - ends[first, 0], ends[right, 1] - ends[first, 1])
            if gap >= farthest[right]:
                break
            first = right
        along_x, along_y = ends[last, 0] - ends[first, 0], ends[last, 1] - ends[first, 1]
        length = math.hypot(along_x, along_y)
        if length > _SHORTEST_M:
            normals[i, 0], normals[i, 1] = -along_y / length, along_x / length
    return normals


@kernel
def _add_points(
    step: NDArray[np.float64],
    points: NDArray[np.float64],
    walls: tuple[NDArray[np.float64], ...],
    gate: float,
    sigma: float,
    gradient: NDArray[np.float64],
    curvature: NDArray[np.float64],
) -> tuple[float, int]:
    """Compare points, moved by a step, with the end points of a scan.

    Returns the sum of their costs and their number; adds the derivatives by the step.
    """
    ends, bearings, ranges, normals, origin = walls
    c, s = math.cos(step[2]), math.sin(step[2])
    n, scale = len(ends), sigma * sigma
    cost, compared = 0.0, 0
    slope = np.empty(3)
    for i in range(len(points)):
        turned_x = c * points[i, 0] - s * points[i, 1]
        turned_y = s * points[i, 0] + c * points[i, 1]
        x, y = turned_x + step[0], turned_y + step[1]
        seen_x, seen_y = x - origin[0], y - origin[1]
        bearing, distance = math.atan2(seen_y, seen_x), math.hypot(seen_x, seen_y)
        left = int(np.searchsorted(bearings, bearing)) % n
        right = (left - 1) % n
        if (bearings[left] - bearings[right]) % FULL_TURN > _WIDEST_GAP_RAD:
            continue  # outside the view
        nearest, least = -1, gate * gate
        for way in (1, -1):
            j = left if way == 1 else right
            for _ in range(n):
                off = abs((bearings[j] - bearing + math.pi) % FULL_TURN - math.pi)
                # No end point in a direction farther off can be nearer.
                if off >= _FARTHEST_OFF_RAD or (distance * math.sin(off)) ** 2 >= least:
                    break
                apart = (ends[j, 0] - x) ** 2 + (ends[j, 1] - y) ** 2
                if apart < least:
                    nearest, least = j, apart
                j = (j + way) % n
        if nearest < 0:
            if distance < min(ranges[left], ranges[right]):  # else hidden behind what was seen
                cost += 1.0
                compared += 1
            continue
        across_x, across_y = normals[nearest, 0], normals[nearest, 1]
        if across_x == 0.0 and across_y == 0.0:
            continue
        compared += 1
        away = across_x * (x - ends[nearest, 0]) + across_y * (y - ends[nearest, 1])
        error = away * away
        cost += error / (error + scale)
        weight = (scale / (error + scale)) ** 2
        slope[0], slope[1] = across_x, across_y
        slope[2] = across_y * turned_x - across_x * turned_y
        for a in range(3):
            gradient[a] += weight * slope[a] * away
            for b in range(3):
                curvature[a, b] += weight * slope[a] * slope[b]
    return cost, compared
