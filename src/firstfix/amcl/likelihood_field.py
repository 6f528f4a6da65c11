"""The likelihood field model: distances of end points to the nearest wall.

Thrun, Burgard & Fox, "Probabilistic Robotics" (2005), table 6.3, with the parameters of Nav2.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.beam_selection import SelectedBeams
from firstfix.amcl.config import AmclConfig, SensorModel
from firstfix.amcl.particles import Particles
from firstfix.core.grid import OccupancyGrid
from firstfix.fields.distance import MAX_LIMIT, truncated_squares
from firstfix.fields.kernel_cache import kernel

# Logarithms are summed as integers: exact, so the same in any order and on any processor, and
# vectorised without reordering floating point. 20 000 beams stay within 31 bits.
_UNIT = 2.0**-12
_LEAST_LIKELIHOOD = 1e-9

# Sensors with range limits of their own whose tables are kept.
_SENSORS = 4

# Particles per block of a kernel: their coordinates and sums stay in the L1 cache.
_BLOCK = 256


class LikelihoodField:
    """The likelihood field of a map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    config : AmclConfig
        Sensor model and its parameters.
    """

    def __init__(self, grid: OccupancyGrid, config: AmclConfig) -> None:
        self.grid = grid
        self.config = config
        limit = math.ceil(config.laser_likelihood_max_dist / grid.resolution)
        self.limit = max(1, min(MAX_LIMIT, limit))
        self.squares = _labelled_squares(grid, self.limit, config)
        # Each is as large as the map, so only those of the robot's sensors are kept.
        self._table = lru_cache(maxsize=_SENSORS)(self._build_table)
        prob = config.laser_model_type is SensorModel.LIKELIHOOD_FIELD_PROB
        # As large as the map: computed once, and only if beams are skipped.
        self._explained = self._near_walls() if prob and config.do_beamskip else None

    def log_likelihood(
        self, particles: Particles, beams: SelectedBeams
    ) -> tuple[NDArray[np.float64], int]:
        """Compute the log-likelihood of a scan at every particle.

        Parameters
        ----------
        particles : Particles
            n particles.
        beams : SelectedBeams
            The scan.

        Returns
        -------
        tuple of ndarray, shape (n,), and int
            Natural logarithm of the product of the likelihoods of all beams that hit (1/m each),
            and how many beams these are.
        """
        poses = _in_cells(particles, self.grid)
        hits = beams.hits / self.grid.resolution
        if self._explained is not None and len(hits) > 0:
            hits = self._unskipped(poses, hits, self._explained)
        sums = np.zeros(len(particles), np.int32)
        _sum_values(*poses, *_columns(hits), self._table(beams.range_max), *self._shape, sums)
        return sums.astype(np.float64) * _UNIT, len(hits)

    @property
    def _shape(self) -> tuple[int, int]:
        height, width = self.squares.shape
        return height, width

    def _build_table(self, range_max: float) -> NDArray[np.int32]:
        """Return the log-likelihood of an end point in each cell, flat, in integer units."""
        by_square = likelihoods(self.limit, self.grid.resolution, range_max, self.config)
        logs = np.log(np.maximum(by_square, _LEAST_LIKELIHOOD)) / _UNIT
        table: NDArray[np.int32] = np.rint(logs).astype(np.int32)[self.squares].ravel()
        table.flags.writeable = False
        return table

    def _near_walls(self) -> NDArray[np.int32]:
        """Return 1 for each cell that explains an end point, else 0; flat."""
        near = min(self.limit, self.config.beam_skip_distance / self.grid.resolution) ** 2
        explained = np.arange(int(self.squares.max()) + 1) < near
        table: NDArray[np.int32] = explained.astype(np.int32)[self.squares].ravel()
        table.flags.writeable = False
        return table

    def _unskipped(
        self, poses: Poses, hits: NDArray[np.float64], explained: NDArray[np.int32]
    ) -> NDArray[np.float64]:
        """Skip the beams that too few particles explain; keep all if too many would be skipped."""
        counts = np.zeros(len(hits), np.int64)
        _count_values(*poses, *_columns(hits), explained, *self._shape, counts)
        keep = counts / len(poses[0]) > self.config.beam_skip_threshold
        return hits if (~keep).mean() >= self.config.beam_skip_error_threshold else hits[keep]


def likelihoods(
    limit: int, resolution: float, range_max: float, config: AmclConfig
) -> NDArray[np.float64]:
    """Likelihood of an end point by its squared distance to the nearest wall.

    Parameters
    ----------
    limit : int
        Largest distance, cells.
    resolution : float
        Side of a cell, m.
    range_max : float
        Reach of the sensor, m.
    config : AmclConfig
        z_hit, z_rand and sigma_hit.

    Returns
    -------
    ndarray, shape (limit² + 2,)
        Likelihood for the squared distances 0 to limit² (cells²), and last for unknown space: any
        range is as likely as any other. 1/m, up to the same constant for all.
    """
    squares_m2 = np.arange(limit**2 + 1) * resolution**2
    hit = np.exp(-0.5 * squares_m2 / config.sigma_hit**2)
    return np.append(config.z_hit * hit + config.z_rand / range_max, 1.0 / range_max)


def _labelled_squares(grid: OccupancyGrid, limit: int, config: AmclConfig) -> NDArray[np.uint16]:
    """Squared distances, cells²; a frame of one cell stands for the world outside the map."""
    squares = truncated_squares(grid.occupied, limit)
    outside = limit**2
    if config.model_unknown_space:
        outside += 1
        squares = np.where(grid.unknown, np.uint16(outside), squares)
    padded: NDArray[np.uint16] = np.pad(squares, 1, constant_values=outside)
    padded.flags.writeable = False
    return padded


Poses = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]


def _in_cells(particles: Particles, grid: OccupancyGrid) -> Poses:
    """Position in the framed field (cells), cosine and sine of the heading in the grid."""
    T = grid.T_map_grid
    c, s = math.cos(T.yaw) / grid.resolution, math.sin(T.yaw) / grid.resolution
    x, y = particles.x - T.x, particles.y - T.y
    yaw = (particles.yaw - T.yaw).astype(np.float32)
    return (
        (c * x + s * y + 1.0).astype(np.float32),
        (c * y - s * x + 1.0).astype(np.float32),
        np.cos(yaw),
        np.sin(yaw),
    )


def _columns(points: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    return points[:, 0].astype(np.float32), points[:, 1].astype(np.float32)


@kernel
def _sum_values(  # noqa: PLR0913 - a kernel takes its arrays one by one
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    cosines: NDArray[np.float32],
    sines: NDArray[np.float32],
    ends_x: NDArray[np.float32],
    ends_y: NDArray[np.float32],
    values: NDArray[np.int32],
    height: int,
    width: int,
    sums: NDArray[np.int32],
) -> None:
    """Add up the values of the cells in which each particle's beams end.

    Beam by beam over a block of particles, first where they end, then the look-ups: alone, the
    first of these loops compiles to vector instructions. Together they take three times as long
    (benchmarks/kernels).
    """
    cells = np.empty(_BLOCK, np.uint32)
    for start in range(0, x.shape[0], _BLOCK):
        m = min(_BLOCK, x.shape[0] - start)
        px, py = x[start : start + m], y[start : start + m]
        c, s = cosines[start : start + m], sines[start : start + m]
        total = sums[start : start + m]
        for b in range(ends_x.shape[0]):
            _find_cells(px, py, c, s, (ends_x[b], ends_y[b]), (height, width), cells)
            for i in range(m):
                total[i] += values[cells[i]]


@kernel
def _count_values(  # noqa: PLR0913 - a kernel takes its arrays one by one
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    cosines: NDArray[np.float32],
    sines: NDArray[np.float32],
    ends_x: NDArray[np.float32],
    ends_y: NDArray[np.float32],
    values: NDArray[np.int32],
    height: int,
    width: int,
    counts: NDArray[np.int64],
) -> None:
    """Add up, for each beam, the values of the cells in which it ends for all particles."""
    cells = np.empty(_BLOCK, np.uint32)
    for start in range(0, x.shape[0], _BLOCK):
        m = min(_BLOCK, x.shape[0] - start)
        px, py = x[start : start + m], y[start : start + m]
        c, s = cosines[start : start + m], sines[start : start + m]
        for b in range(ends_x.shape[0]):
            _find_cells(px, py, c, s, (ends_x[b], ends_y[b]), (height, width), cells)
            for i in range(m):
                counts[b] += values[cells[i]]


@kernel
def _find_cells(
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    cosines: NDArray[np.float32],
    sines: NDArray[np.float32],
    end: tuple[np.float32, np.float32],
    shape: tuple[int, int],
    cells: NDArray[np.uint32],
) -> None:
    """Write in which cell of the flat field a beam ends for each particle; outside, the nearest."""
    ex, ey = end
    height, width = shape
    last_x, last_y = np.float32(width - 1), np.float32(height - 1)
    zero, pitch = np.float32(0.0), np.int32(width)
    for i in range(x.shape[0]):
        column = np.int32(min(max(x[i] + cosines[i] * ex - sines[i] * ey, zero), last_x))
        row = np.int32(min(max(y[i] + sines[i] * ex + cosines[i] * ey, zero), last_y))
        cells[i] = np.uint32(np.int32(row * pitch) + column)
