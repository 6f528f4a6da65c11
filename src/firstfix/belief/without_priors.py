"""What the views alone say of the places, with priors left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.hints import Hint, Source, hint_logs, log_anywhere
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.prior import NEAR_LOG


def shares_by_views(
    tracks: Tracks,
    probabilities: NDArray[np.float64],
    missed: float,
    seen: Observation,
    hints: Sequence[Hint],
    fields: MapFields,
) -> NDArray[np.float64]:
    """Return the probabilities of places with all priors left out, shape (n,).

    Parameters
    ----------
    tracks : Tracks
        The places.
    probabilities : ndarray, shape (n,)
        With priors.
    missed : float
        Probability of the places of the map that are not held, with priors.
    seen : Observation
        The newest view.
    hints : sequence of Hint
        The priors.
    fields : MapFields
        The prepared map.
    """
    weights = probabilities * np.exp(-hint_logs(tracks.now, seen, hints, fields.grid))
    nowhere = max(0.0, 1.0 - float(probabilities.sum()) - missed)
    elsewhere = nowhere + missed * np.exp(-log_anywhere(seen, hints, fields))
    shares: NDArray[np.float64] = weights / (weights.sum() + elsewhere)
    return shares


def share_without_programs(
    tracks: Tracks,
    probabilities: NDArray[np.float64],
    seen: Observation,
    hints: Sequence[Hint],
    fields: MapFields,
) -> float:
    """Return the probability of the best place with the priors of programs left out."""
    measured = [hint for hint in hints if hint.source is Source.MEASURED]
    if not measured or len(tracks) == 0:
        return 1.0
    logs = hint_logs(tracks.now, seen, measured, fields.grid)
    if not logs.any():
        return 1.0
    weights = probabilities * np.exp(-logs)
    elsewhere = max(0.0, 1.0 - float(probabilities.sum()))
    return float(weights[0] / (weights.sum() + elsewhere))


def is_hinted(tracks: Tracks, seen: Observation, hints: Sequence[Hint], fields: MapFields) -> bool:
    """Tell whether priors speak for the best place."""
    if not hints or len(tracks) == 0:
        return False
    return bool(hint_logs(tracks.now[:1], seen, hints, fields.grid)[0] >= NEAR_LOG)
