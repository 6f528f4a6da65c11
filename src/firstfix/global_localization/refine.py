"""Refinement of poses from the search grid: Gauss-Newton on two residuals.

First on the distance field, which has a wide basin of attraction and is cheap, for every place of
the shortlist. Then on cast rays, which distinguish the two sides of a wall, for the best places.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.kernel_cache import kernel, part
from firstfix.fields.map_fields import MapFields
from firstfix.fields.raycast import cast_ray_leaping
from firstfix.global_localization.beams import Beams

FIELD_BEAMS = 60
RAY_BEAMS = 180

# Width of the weights on the distance field. The search grid leaves a pose up to 0.14 m and 1.4
# degrees off: wide first, then as sharp as maps are.
_FIRST_SIGMA_M = 0.3
_LAST_SIGMA_M = 0.07
_FIELD_ROUNDS = 8
# An end point this many sigmas from every wall hit something that is not in the map.
_FIELD_GATE = 3.0

# Prior of a step on the field, in beams that hold the pose where it is: without a prior a pose in a
# corridor slides along it. Half a beam for x and y; half a beam at a lever of 1 m for the heading.
_STIFFNESS_BEAMS = 0.5
_STIFFNESS_BEAMS_M2 = 0.5
# The same on rays: just enough for a solvable system if no wall faces any ray.
_RAY_STIFFNESS_BEAMS = 0.01
_RAY_STIFFNESS_BEAMS_M2 = 0.0025

# Longest step of a round: the linearisation holds for about the width of the weights. On the field
# that is `_FIELD_GATE` sigmas and this heading.
_FIELD_STEP_RAD = 0.05
_RAY_STEP_M = 0.1
_RAY_STEP_RAD = 0.03

_RAY_ROUNDS = 8
# A step below these is none: a thousandth of what maps are true to.
_SETTLED_M = 0.00025
_SETTLED_RAD = 5e-5
_RAY_SIGMA_M = 0.1
# A ray that differs by more hit something that is not in the map.
_RAY_GATE_M = 0.3
# Least cosine between ray and wall normal: the range of a grazing ray is no constraint.
_LEAST_SLANT = 0.1

# Keeps the division by the longest coordinate of a step that is zero defined.
_TINY = 1e-12

# The rest is about how maps are drawn, so it is in cells. A drawn or simulated wall is seen at the
# face of its cells, one that a mapping run has drawn lies in their middle: 0.25 +- 0.25 cells
# behind the face, to be found with the pose; no more than half a cell a round.
_WALL_DEPTH_CELLS = 0.25
_WALL_DEPTH_SIGMA_CELLS = 0.25
_WALL_DEPTH_STEP_CELLS = 0.5
# The normal of a wall is taken one cell before its face: inside, the distance field is flat.
_BEFORE_WALL_CELLS = 1.0
# A ray is cast this far beyond the gate, so that one that meets nothing is beyond it too.
_BEYOND_GATE_CELLS = 2.0
# Slope of the distance field (cells over two cells) below which it has no direction.
_FLAT = 1e-3
# A quarter of the variance of a uniform error of one cell: a perfect drawing must not look exact.
_LEAST_VARIANCE_CELLS2 = 1.0 / 48.0

# Neighbouring beams err together (the same wall drawn askew): this many count as one.
_BEAMS_PER_EFFECTIVE_BEAM = 4.0
# However many beams agree, a map is not truer than a quarter of a cell and a tenth of a degree.
MAP_COVARIANCE = np.diag([0.25**2, 0.25**2, math.radians(0.1) ** 2])
"""Covariance of the errors of a map at one place: x, y (cells), heading (rad)."""


def refine_on_field(
    poses: NDArray[np.float64], beams: Beams, fields: MapFields
) -> NDArray[np.float64]:
    """Move poses to where the end points of the beams lie on walls.

    Gauss-Newton on the bilinear distance field with Geman-McClure weights, whose width shrinks
    from round to round.

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
    ndarray, shape (n, 3)
        The refined poses.
    """
    hits = beams.hits().thinned(FIELD_BEAMS)
    resolution = fields.grid.resolution
    sigmas = np.geomspace(_FIRST_SIGMA_M, max(_LAST_SIGMA_M, resolution), _FIELD_ROUNDS)
    refined = poses.copy()
    _descend_field(
        refined,
        hits.starts[:, 0] / resolution + hits.ranges / resolution * np.cos(hits.bearings),
        hits.starts[:, 1] / resolution + hits.ranges / resolution * np.sin(hits.bearings),
        fields.squares,
        fields.distances,
        sigmas / resolution,
        _STIFFNESS_BEAMS_M2 / resolution**2,
        (np.empty((3, 3)), np.empty((3, 3)), np.empty(3)),
    )
    return refined


def refine_on_rays(
    poses: NDArray[np.float64], beams: Beams, fields: MapFields
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Move poses to where measured and cast ranges agree, below the size of a cell.

    Point-to-line alignment (Censi 2008) against the wall that each ray meets; the depth of the
    walls in their cells is estimated along with the pose.

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
    poses : ndarray, shape (n, 3)
        The refined poses.
    covariances : ndarray, shape (n, 3, 3)
        Of x, y (cells), heading (rad) of the sensor in the grid.
    """
    hits = beams.hits().thinned(RAY_BEAMS)
    resolution = fields.grid.resolution
    refined = poses.copy()
    information, variances = np.empty((len(poses), 4, 4)), np.empty(len(poses))
    _descend_rays(
        refined,
        information,
        variances,
        hits.starts / resolution,
        np.cos(hits.bearings),
        np.sin(hits.bearings),
        hits.ranges / resolution,
        fields.clearance,
        fields.squares,
        fields.distances,
        resolution,
        (np.empty(4), np.empty((4, 4)), np.empty(4)),
    )
    # Marginalise the depth of the walls: invert first, then drop its row and column.
    covariances = np.linalg.inv(information)[:, :3, :3] * variances[:, None, None]
    return refined, covariances * _BEAMS_PER_EFFECTIVE_BEAM + MAP_COVARIANCE


@kernel
def _descend_field(  # noqa: PLR0913 - a kernel takes its arrays one by one
    poses: NDArray[np.float64],
    ends_x: NDArray[np.float64],
    ends_y: NDArray[np.float64],
    squares: NDArray[np.uint16],
    distances: NDArray[np.float32],
    sigmas: NDArray[np.float64],
    heading_stiffness: float,
    scratch: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
) -> None:
    height, width = squares.shape
    A, L, g = scratch
    for k in range(poses.shape[0]):
        for s in range(sigmas.shape[0]):
            sigma = sigmas[s]
            _clear(A, g)
            A[0, 0] = A[1, 1] = _STIFFNESS_BEAMS
            A[2, 2] = heading_stiffness
            cos, sin = math.cos(poses[k, 2]), math.sin(poses[k, 2])
            for i in range(ends_x.shape[0]):
                px, py = cos * ends_x[i] - sin * ends_y[i], sin * ends_x[i] + cos * ends_y[i]
                fx, fy = poses[k, 0] + px - 0.5, poses[k, 1] + py - 0.5
                cx, cy = math.floor(fx), math.floor(fy)
                if cx < 0 or cy < 0 or cx + 1 >= width or cy + 1 >= height:
                    continue
                u, v = fx - cx, fy - cy
                d00, d10 = distances[squares[cy, cx]], distances[squares[cy, cx + 1]]
                d01, d11 = distances[squares[cy + 1, cx]], distances[squares[cy + 1, cx + 1]]
                d = (d00 * (1 - u) + d10 * u) * (1 - v) + (d01 * (1 - u) + d11 * u) * v
                if d > _FIELD_GATE * sigma:
                    continue
                w = 1.0 / (1.0 + (d / sigma) ** 2) ** 2
                jx = (d10 - d00) * (1 - v) + (d11 - d01) * v
                jy = (d01 - d00) * (1 - u) + (d11 - d10) * u
                jt = px * jy - py * jx
                A[0, 0] += w * jx * jx
                A[1, 0] += w * jx * jy
                A[2, 0] += w * jx * jt
                A[1, 1] += w * jy * jy
                A[2, 1] += w * jy * jt
                A[2, 2] += w * jt * jt
                g[0] += w * jx * d
                g[1] += w * jy * d
                g[2] += w * jt * d
            _solve(A, L, g)
            shrink = min(1.0, _FIELD_GATE * sigma / max(abs(g[0]), abs(g[1]), _TINY))
            poses[k, 0] -= shrink * g[0]
            poses[k, 1] -= shrink * g[1]
            poses[k, 2] -= _clipped(g[2], _FIELD_STEP_RAD)


@kernel
def _solve(A: NDArray[np.float64], L: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    """Solve A x = b by Cholesky's A = L L'; only the lower half of A counts, b becomes x."""
    # Numba's version of NumPy's solver needs SciPy, which is no dependency.
    n = b.shape[0]
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(total) if i == j else total / L[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= L[i, k] * b[k]
        b[i] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= L[k, i] * b[k]
        b[i] /= L[i, i]


@kernel
def _descend_rays(  # noqa: PLR0913 - a kernel takes its arrays one by one
    poses: NDArray[np.float64],
    information: NDArray[np.float64],
    variances: NDArray[np.float64],
    starts: NDArray[np.float64],
    cosines: NDArray[np.float64],
    sines: NDArray[np.float64],
    ranges: NDArray[np.float64],
    clearance: NDArray[np.uint8],
    squares: NDArray[np.uint16],
    distances: NDArray[np.float32],
    resolution: float,
    scratch: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
) -> None:
    sigma, gate = _RAY_SIGMA_M / resolution, _RAY_GATE_M / resolution
    step, settled = _RAY_STEP_M / resolution, _SETTLED_M / resolution
    J, L, g = scratch
    for k in range(poses.shape[0]):
        A = information[k]
        depth = _WALL_DEPTH_CELLS
        for _ in range(_RAY_ROUNDS):
            _clear(A, g)
            A[0, 0] = A[1, 1] = _RAY_STIFFNESS_BEAMS
            A[2, 2] = _RAY_STIFFNESS_BEAMS_M2 / resolution**2
            weights, squared = 0.0, 0.0
            A[3, 3] = 1.0 / _WALL_DEPTH_SIGMA_CELLS**2
            g[3] = (depth - _WALL_DEPTH_CELLS) / _WALL_DEPTH_SIGMA_CELLS**2
            cos, sin = math.cos(poses[k, 2]), math.sin(poses[k, 2])
            for i in range(ranges.shape[0]):
                dx = cos * cosines[i] - sin * sines[i]
                dy = sin * cosines[i] + cos * sines[i]
                arm_x = cos * starts[i, 0] - sin * starts[i, 1]
                arm_y = sin * starts[i, 0] + cos * starts[i, 1]
                x, y = poses[k, 0] + arm_x, poses[k, 1] + arm_y
                reach = ranges[i] + gate + _BEYOND_GATE_CELLS
                expected = cast_ray_leaping(clearance, x, y, dx, dy, reach)
                nx, ny = _normal(
                    squares,
                    distances,
                    x + (expected - _BEFORE_WALL_CELLS) * dx,
                    y + (expected - _BEFORE_WALL_CELLS) * dy,
                )
                slant = nx * dx + ny * dy
                if slant < _LEAST_SLANT:
                    continue
                residual = (ranges[i] - expected) * slant - depth
                if abs(residual) > gate:
                    continue
                w = math.exp(-0.5 * (residual / sigma) ** 2)
                J[0], J[1] = nx, ny
                J[2] = ranges[i] * (dx * ny - dy * nx) + (arm_x * ny - arm_y * nx)
                J[3] = -1.0
                for a in range(4):
                    g[a] += w * J[a] * residual
                    for b in range(4):
                        A[a, b] += w * J[a] * J[b]
                weights += w
                squared += w * residual * residual
            _solve(A, L, g)
            poses[k, 0] -= _clipped(g[0], step)
            poses[k, 1] -= _clipped(g[1], step)
            poses[k, 2] -= _clipped(g[2], _RAY_STEP_RAD)
            depth -= _clipped(g[3], _WALL_DEPTH_STEP_CELLS)
            if abs(g[0]) + abs(g[1]) < settled and abs(g[2]) < _SETTLED_RAD:
                break
        variances[k] = max(squared / max(weights, 1.0), _LEAST_VARIANCE_CELLS2)


@part
def _clear(A: NDArray[np.float64], g: NDArray[np.float64]) -> None:
    for i in range(g.shape[0]):
        g[i] = 0.0
        for j in range(g.shape[0]):
            A[i, j] = 0.0


@part
def _clipped(value: float, most: float) -> float:
    return max(-most, min(most, value))


@part
def _normal(
    squares: NDArray[np.uint16], distances: NDArray[np.float32], x: float, y: float
) -> tuple[float, float]:
    """Direction towards the nearest wall: minus the gradient of the distance field; 0 if flat."""
    height, width = squares.shape
    column, row = math.floor(x), math.floor(y)
    if column < 1 or row < 1 or column + 1 >= width or row + 1 >= height:
        return 0.0, 0.0
    gx = np.float64(distances[squares[row, column + 1]]) - distances[squares[row, column - 1]]
    gy = np.float64(distances[squares[row + 1, column]]) - distances[squares[row - 1, column]]
    length = math.hypot(gx, gy)
    if length < _FLAT:
        return 0.0, 0.0
    return -gx / length, -gy / length
