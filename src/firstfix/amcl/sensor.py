"""Likelihood of a scan at every particle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.beam_selection import SelectedBeams
from firstfix.amcl.config import AmclConfig, SensorModel
from firstfix.amcl.likelihood_field import LikelihoodField
from firstfix.amcl.particles import Particles
from firstfix.amcl.ray_model import RayModel
from firstfix.core.grid import OccupancyGrid

# Neighbouring beams hit the same walls, the same person, the same error of the map. Multiplied as
# if they were independent, they make a belief overconfident; so all beams of one time, whatever
# their sensor, count together as this many effective beams (docs/decisions/0010).
EFFECTIVE_BEAMS = 15


class Sensor(Protocol):
    """A sensor model with its map."""

    def log_likelihood(
        self, particles: Particles, beams: SelectedBeams
    ) -> tuple[NDArray[np.float64], int]:
        """Return the log-likelihood of a scan at each particle, and of how many beams."""


def build_sensor(grid: OccupancyGrid, config: AmclConfig) -> Sensor:
    """Prepare a map for the sensor model of the configuration.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    config : AmclConfig
        laser_model_type and the parameters of the model.

    Returns
    -------
    Sensor
        The sensor model.
    """
    if config.laser_model_type is SensorModel.BEAM:
        return RayModel(grid, config)
    return LikelihoodField(grid, config)


def weigh(
    particles: Particles, scans: Sequence[SelectedBeams], sensor: Sensor
) -> tuple[NDArray[np.float64], float]:
    """Compute the likelihood of the scans of one time at every particle.

    Parameters
    ----------
    particles : Particles
        The belief, n particles.
    scans : sequence of SelectedBeams
        The scan of each sensor; at least one.
    sensor : Sensor
        The sensor model.

    Returns
    -------
    tuple of ndarray, shape (n,), and float
        Likelihood of the scans at each particle, 1 at the best; and the fit of the belief:
        geometric mean of the likelihoods of the beams, 1/m, NaN if no beam took part.
    """
    first, *others = scans
    logs, used = sensor.log_likelihood(particles, first)
    for beams in others:
        more_logs, more = sensor.log_likelihood(particles, beams)
        logs, used = logs + more_logs, used + more
    # No `@`: its order of summation, and so its rounding, may depend on the number of threads.
    mean = float((particles.weight * logs).sum())
    fit = math.exp(mean / used) if used else math.nan
    share = min(1.0, EFFECTIVE_BEAMS / sum(beams.chosen for beams in scans))
    return np.exp(share * (logs - logs.max())), fit
