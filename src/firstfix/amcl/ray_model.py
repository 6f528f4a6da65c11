"""The beam model: expected ranges by ray casting.

Thrun, Burgard & Fox, "Probabilistic Robotics" (2005), table 6.1, with the parameters of Nav2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.beam_selection import SelectedBeams
from firstfix.amcl.config import AmclConfig
from firstfix.amcl.particles import Particles
from firstfix.core.grid import OccupancyGrid
from firstfix.fields.clearance import chessboard_clearance
from firstfix.fields.kernel_cache import kernel
from firstfix.fields.raycast import cast_ray_leaping


class RayModel:
    """The beam model of a map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    config : AmclConfig
        The parameters of the mixture.
    """

    def __init__(self, grid: OccupancyGrid, config: AmclConfig) -> None:
        self.grid = grid
        self.config = config
        self.clearance = chessboard_clearance(grid.occupied)
        self.clearance.flags.writeable = False

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
            Natural logarithm of the product of the likelihoods of all beams, and the number of
            beams, including those without a return.
        """
        config, resolution = self.config, self.grid.resolution
        T_base_laser, T_map_grid = beams.T_base_laser, self.grid.T_map_grid
        cos, sin = np.cos(particles.yaw), np.sin(particles.yaw)
        sensors = self.grid.to_cells(
            np.column_stack(
                [
                    particles.x + cos * T_base_laser.x - sin * T_base_laser.y,
                    particles.y + sin * T_base_laser.x + cos * T_base_laser.y,
                ]
            )
        )
        logs = _log_of_mixture(
            sensors,
            particles.yaw - T_map_grid.yaw,
            beams.bearings,
            beams.ranges,
            self.clearance,
            (resolution, beams.range_max),
            (config.z_hit, config.z_short, config.z_max, config.z_rand),
            (config.sigma_hit, config.lambda_short),
        )
        return logs, len(beams)


@kernel
def _log_of_mixture(  # noqa: PLR0913 - a kernel takes its arrays one by one
    sensors: NDArray[np.float64],
    headings: NDArray[np.float64],
    bearings: NDArray[np.float64],
    ranges: NDArray[np.float64],
    clearance: NDArray[np.uint8],
    lengths: tuple[float, float],
    mixture: tuple[float, float, float, float],
    shape: tuple[float, float],
) -> NDArray[np.float64]:
    """Sum the logarithms of hit, short, max and random (without normalisers, as in Nav2)."""
    resolution, range_max = lengths
    z_hit, z_short, z_max, z_rand = mixture
    sigma_hit, lambda_short = shape
    reach = range_max / resolution
    logs = np.zeros(sensors.shape[0])
    for b in range(bearings.shape[0]):
        measured = ranges[b]
        early = z_short * lambda_short * math.exp(-lambda_short * measured)
        anyway = z_max if measured >= range_max else z_rand / range_max
        for k in range(sensors.shape[0]):
            along = headings[k] + bearings[b]
            expected = resolution * cast_ray_leaping(
                clearance, sensors[k, 0], sensors[k, 1], math.cos(along), math.sin(along), reach
            )
            off = measured - expected
            p = anyway + z_hit * math.exp(-0.5 * (off / sigma_hit) ** 2)
            if off < 0.0:
                p += early
            logs[k] += math.log(max(p, 1e-9))
    return logs
