"""The places of a belief as others see them: pose in the map, covariance, evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.planar import compose
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation
from firstfix.core.estimate import Hypothesis
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.refine import refine_on_rays
from firstfix.global_localization.verify import verified_place, verify

_MOST_LISTED = 24
_LEAST_LISTED = 2
_LISTED_SHARE = 1e-3


def listed_places(
    tracks: Tracks,
    probabilities: NDArray[np.float64],
    seen: Observation,
    step: SE2,
    fields: MapFields,
) -> tuple[Hypothesis, ...]:
    """Describe the likeliest places, at most 24.

    Parameters
    ----------
    tracks : Tracks
        Most likely first.
    probabilities : ndarray, shape (n,)
        Of the tracks.
    seen : Observation
        The newest view.
    step : SE2
        Motion of the base since that view.
    fields : MapFields
        The prepared map.

    Returns
    -------
    tuple of Hypothesis
        Those with a thousandth of what all places have, and at least two if there are two;
        with their ids.
    """
    worth = int(np.count_nonzero(probabilities >= _LISTED_SHARE * probabilities.sum()))
    n = min(len(tracks), _MOST_LISTED, max(_LEAST_LISTED, worth))
    if n == 0:
        return ()
    sensor = seen.sensor
    lasers = compose(tracks.now[:n], sensor.T_base_laser)
    _, covariances = refine_on_rays(lasers, sensor.beams, fields)
    verification = verify(lasers, sensor.beams, fields)
    found = [
        verified_place(
            fields.grid, sensor.scan, verification, i, covariances[i], float(probabilities[i])
        )
        for i in range(n)
    ]
    return tuple(
        replace(hypothesis, pose=hypothesis.pose @ step, id=int(name))
        for name, hypothesis in zip(tracks.ids[:n], found, strict=True)
    )
