"""Places enter the belief: those that a view's own search of the whole map proposes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.config import BeliefConfig
from firstfix.belief.hints import Hint, hint_logs
from firstfix.belief.planar import compose, inverse
from firstfix.belief.tracks import BEAMS, Tracks
from firstfix.belief.view import Observation, costs, settle
from firstfix.core.estimate import SearchReport
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import DIRECTIONS
from firstfix.fields.search_grid import MAX_POSITIONS
from firstfix.global_localization.look import find_places
from firstfix.global_localization.prior import DEEPER, NEAR_LOG
from firstfix.global_localization.search import Candidates

_ALL_POSES = MAX_POSITIONS * DIRECTIONS


def propose(
    window: Sequence[Observation],
    hints: Sequence[Hint],
    first_id: int,
    fields: MapFields,
    config: BeliefConfig,
    found: Candidates | None = None,
) -> tuple[Tracks, SearchReport]:
    """Search the whole map for the newest view, and settle the best places on the walls.

    Parameters
    ----------
    window : sequence of Observation
        Oldest first; a first view is searched more deeply.
    hints : sequence of Hint
        The best places near these enter, too.
    first_id : int
        Id of the best place; the others follow.
    fields : MapFields
        The prepared map.
    config : BeliefConfig
        Settings.
    found : Candidates, optional
        What a search of several maps together has found in this one; it is not searched again.

    Returns
    -------
    tracks : Tracks
        Over the newest view only.
    report : SearchReport
        What was searched.
    """
    seen = window[-1]
    sensor = seen.sensor
    most = shortlist_of(config, is_first=len(window) == 1)
    if found is None:
        depth = most * DEEPER if hints else most
        candidates, report = find_places(sensor.beams, fields, depth, _ALL_POSES)
    else:
        poses_of_map = len(fields.positions) * DIRECTIONS
        candidates, report = found, SearchReport(poses_of_map, searched=1.0, proven=False)
    poses = compose(candidates.poses, inverse(sensor.T_base_laser))
    if hints:
        poses = poses[_best_and_hinted(poses, most, seen, hints, fields)]
    poses = settle(poses, seen, fields)
    ids = first_id + np.arange(len(poses))
    return Tracks.at(poses, costs(poses, seen, BEAMS, fields), ids), report


def shortlist_of(config: BeliefConfig, *, is_first: bool) -> int:
    """Return how many places enter by a view; a first view is searched more deeply."""
    return config.first_shortlist if is_first else config.shortlist


def _best_and_hinted(
    poses: NDArray[np.float64],
    most: int,
    seen: Observation,
    hints: Sequence[Hint],
    fields: MapFields,
) -> NDArray[np.int64]:
    """Return the indices of the first places, and of as many that are near the hints."""
    near = np.flatnonzero(hint_logs(poses, seen, hints, fields.grid) >= NEAR_LOG)
    return np.unique(np.concatenate([np.arange(min(most, len(poses))), near[:most]]))
