"""Local adjustment of poses to a view, within what odometry leaves uncertain."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.planar import compose, inverse
from firstfix.belief.view import Observation, motion
from firstfix.core.angles import wrap
from firstfix.fields.kernel_cache import kernel
from firstfix.fields.map_fields import MapFields

# What odometry leaves open between two views: a constant and a share of the way. On nine robots,
# nine of ten errors are within three of these standard deviations.
_SIGMA_M, _SIGMA_PER_PATH = 0.03, 0.05
_SIGMA_RAD, _SIGMA_PER_TURN, _SIGMA_PER_M = math.radians(1.0), 0.1, math.radians(2.0)

# End points in a map are good to 0.1 m, and neighbouring beams err together: four say as much as
# one.
_BEAM_SIGMA_M = 0.1
_BEAMS_PER_WITNESS = 4.0

_BEAMS = 40
_ROUNDS = 4
_FIRST_SIGMA_M, _LAST_SIGMA_M = 0.2, 0.08

# Wheels slip now and then: the tails of Student's t with three degrees of freedom.
_FREEDOM = 3.0


@dataclass(frozen=True, slots=True)
class Slack:
    """Standard deviations of the odometry between two views.

    Parameters
    ----------
    cells : float
        Of each coordinate, cells.
    rad : float
        Of the heading, rad.
    """

    cells: float
    rad: float


def slack_between(start: Observation, end: Observation) -> Slack:
    """Return what odometry leaves open between two observations."""
    path, turn = motion(start, end)
    return Slack(
        cells=_SIGMA_M / start.resolution + _SIGMA_PER_PATH * path,
        rad=_SIGMA_RAD + _SIGMA_PER_TURN * turn + _SIGMA_PER_M * path * start.resolution,
    )


def adjust(
    predicted: NDArray[np.float64], seen: Observation, slack: Slack, fields: MapFields
) -> NDArray[np.float64]:
    """Move poses to where a view fits better, held back by the odometry.

    Gauss-Newton on the distance field; the prediction is a prior with the slack's covariance.

    Parameters
    ----------
    predicted : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the base in the grid, by odometry.
    seen : Observation
        The view.
    slack : Slack
        Of the odometry.
    fields : MapFields
        The prepared map.

    Returns
    -------
    ndarray, shape (n, 3)
        The adjusted poses.
    """
    sensor = seen.sensor
    hits = sensor.beams.hits().thinned(_BEAMS)
    resolution = fields.grid.resolution
    poses = compose(predicted, sensor.T_base_laser)
    ends_x, ends_y = np.ascontiguousarray(hits.ends.T / resolution)
    witness = _BEAMS_PER_WITNESS * (_BEAM_SIGMA_M / resolution) ** 2 * len(hits) / _BEAMS
    sigmas = np.geomspace(_FIRST_SIGMA_M, max(_LAST_SIGMA_M, resolution), _ROUNDS)
    _descend(
        poses,
        ends_x,
        ends_y,
        fields.squares,
        fields.distances,
        sigmas / resolution,
        (witness / slack.cells**2, witness / slack.rad**2),
    )
    return compose(poses, inverse(sensor.T_base_laser))


def strains(
    predicted: NDArray[np.float64], adjusted: NDArray[np.float64], slack: Slack
) -> NDArray[np.float64]:
    """Return how unlikely odometry makes adjustments, shape (n,): minus log-likelihoods, nats."""
    moved = ((adjusted - predicted)[:, :2] / slack.cells) ** 2
    turned = (wrap(adjusted[:, 2] - predicted[:, 2]) / slack.rad) ** 2
    squared: NDArray[np.float64] = moved.sum(axis=1) + turned
    return 0.5 * (_FREEDOM + 1.0) * np.log1p(squared / _FREEDOM)


@kernel
def _descend(
    poses: NDArray[np.float64],
    ends_x: NDArray[np.float64],
    ends_y: NDArray[np.float64],
    squares: NDArray[np.uint16],
    distances: NDArray[np.float32],
    sigmas: NDArray[np.float64],
    stiffness: tuple[float, float],
) -> None:
    height, width = squares.shape
    for k in range(poses.shape[0]):
        x0, y0, t0 = poses[k, 0], poses[k, 1], poses[k, 2]
        x, y, t = x0, y0, t0
        for sigma in sigmas:
            axx = ayy = stiffness[0]
            att = stiffness[1]
            axy = axt = ayt = 0.0
            gx, gy, gt = stiffness[0] * (x - x0), stiffness[0] * (y - y0), stiffness[1] * (t - t0)
            cos, sin = math.cos(t), math.sin(t)
            for i in range(ends_x.shape[0]):
                px, py = cos * ends_x[i] - sin * ends_y[i], sin * ends_x[i] + cos * ends_y[i]
                fx, fy = x + px - 0.5, y + py - 0.5
                cx, cy = math.floor(fx), math.floor(fy)
                if cx < 0 or cy < 0 or cx + 1 >= width or cy + 1 >= height:
                    continue
                u, v = fx - cx, fy - cy
                d00, d10 = distances[squares[cy, cx]], distances[squares[cy, cx + 1]]
                d01, d11 = distances[squares[cy + 1, cx]], distances[squares[cy + 1, cx + 1]]
                d = (d00 * (1 - u) + d10 * u) * (1 - v) + (d01 * (1 - u) + d11 * u) * v
                if d > 3.0 * sigma:
                    continue
                w = 1.0 / (1.0 + (d / sigma) ** 2) ** 2
                jx = (d10 - d00) * (1 - v) + (d11 - d01) * v
                jy = (d01 - d00) * (1 - u) + (d11 - d10) * u
                jt = px * jy - py * jx
                axx += w * jx * jx
                axy += w * jx * jy
                axt += w * jx * jt
                ayy += w * jy * jy
                ayt += w * jy * jt
                att += w * jt * jt
                gx += w * jx * d
                gy += w * jy * d
                gt += w * jt * d
            # The heading first, then the two coordinates (Schur complement).
            bxx, bxy, byy = axx - axt * axt / att, axy - axt * ayt / att, ayy - ayt * ayt / att
            hx, hy = gx - axt * gt / att, gy - ayt * gt / att
            determinant = max(1e-12, bxx * byy - bxy * bxy)
            dx = (byy * hx - bxy * hy) / determinant
            dy = (bxx * hy - bxy * hx) / determinant
            dt = (gt - axt * dx - ayt * dy) / att
            shrink = min(1.0, 3.0 * sigma / max(abs(dx), abs(dy), 1e-12))
            x -= shrink * dx
            y -= shrink * dy
            t -= max(-0.05, min(0.05, dt))
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, t
