"""Priors that were given at some time, and what they say of the places now."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.planar import between, compose, to_map
from firstfix.belief.view import Observation
from firstfix.core.angles import FULL_TURN
from firstfix.core.grid import OccupancyGrid
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.prior import Prior

# After so long a way odometry no longer tells where the prior was.
_FADES_M = 10.0

# A robot may be anywhere: at so many positions of the map, with so many headings each.
_SAMPLED, _SAMPLED_HEADINGS = 500, 8


class Source(Enum):
    """Who gives a prior."""

    PERSON = "a person, who may choose among places that look alike"
    MEASURED = "a program, which may be wrong without anybody noticing"


@dataclass(frozen=True, eq=False, slots=True)
class Hint:
    """A prior, and where odometry was when it held.

    Parameters
    ----------
    prior : Prior
        Of the pose of the base in the map.
    odometry : ndarray, shape (3,), or None
        Pose of the base in the odometry frame, cells and rad; None until the first view.
    source : Source
        Who gave it.
    """

    prior: Prior
    odometry: NDArray[np.float64] | None
    source: Source = Source.MEASURED


def hint_logs(
    poses: NDArray[np.float64], seen: Observation, hints: Sequence[Hint], grid: OccupancyGrid
) -> NDArray[np.float64]:
    """Return what the hints say of poses at a view, shape (n,): log-likelihoods up to 0.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the base in the grid.
    seen : Observation
        The view.
    hints : sequence of Hint
        All with their odometry.
    grid : OccupancyGrid
        The map.
    """
    logs = np.zeros(len(poses))
    for hint in hints:
        if hint.odometry is None:
            continue
        back = between(seen.odometry, hint.odometry)
        if np.hypot(back[0], back[1]) * grid.resolution <= _FADES_M:
            logs += hint.prior.log_likelihood(to_map(compose(poses, back), grid))
    return logs


def log_anywhere(seen: Observation, hints: Sequence[Hint], fields: MapFields) -> float:
    """Return what the hints say of a place anywhere in the map: the log of the mean likelihood."""
    positions = fields.positions
    if not hints or len(positions) == 0:
        return 0.0
    index = np.unique(np.linspace(0, len(positions) - 1, _SAMPLED).round().astype(np.int64))
    xy = np.repeat(np.column_stack(positions.centres(index)), _SAMPLED_HEADINGS, axis=0)
    turns = np.tile(np.arange(_SAMPLED_HEADINGS) * (FULL_TURN / _SAMPLED_HEADINGS), len(index))
    logs = hint_logs(np.column_stack([xy, turns]), seen, hints, fields.grid)
    return float(np.log(np.mean(np.exp(logs))))
