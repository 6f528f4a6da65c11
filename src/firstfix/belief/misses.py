"""How many views in a row the best place does not explain, though others do."""

from __future__ import annotations

from collections.abc import Sequence

from firstfix.belief.evidence import WRONG_MAP_COST
from firstfix.belief.judge import ALONE_PROBABILITY, Favourite, Judgement
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Link, Observation
from firstfix.global_localization.places import distinct_places
from firstfix.global_localization.verdict import exponent_of, place_probabilities

MOST_MISSES = 2
"""After so many the robot has been moved, or its wheels have slipped: earlier views say nothing."""

# A published place is kept longer if all views go on from each other: the robot was not moved, only
# wheels may have slipped.
_MOST_MISSES_IN_A_ROW = 8

# Places of a view that are compared with its best one.
_COMPARED = 24


def has_missed_enough(
    misses: int, window: Sequence[Observation], favourite: Favourite | None
) -> bool:
    """Tell whether the earlier views say nothing any more.

    Parameters
    ----------
    misses : int
        Views in a row that the best place does not explain though others do.
    window : sequence of Observation
        The views, oldest first.
    favourite : Favourite or None
        The place that was sure before the newest view, if any.
    """
    is_kept = favourite is not None and favourite.published
    goes_on = all(seen.link is Link.GOES_ON for seen in window[-_MOST_MISSES_IN_A_ROW:])
    return misses >= (_MOST_MISSES_IN_A_ROW if is_kept and goes_on else MOST_MISSES)


def count_misses(
    before: int, judgement: Judgement, tracks: Tracks, entering: Tracks, seen: Observation
) -> int:
    """Count the views in a row that the best place does not explain though others do.

    Parameters
    ----------
    before : int
        The count at the view before.
    judgement : Judgement
        Of the newest view.
    tracks : Tracks
        Most likely first.
    entering : Tracks
        Places of the newest view's search, over this view only.
    seen : Observation
        The newest view.
    """
    if not judgement.unexplained or len(entering) == 0:
        return 0
    best = float(tracks.costs[0, -1]) if len(tracks) else WRONG_MAP_COST
    if entering.costs[:, 0].min() >= 0.5 * best:
        return 0
    # One look of a sensor that sees much is enough to know that what was seen before misleads.
    return MOST_MISSES if _is_decisive(entering, seen) else before + 1


def _is_decisive(entering: Tracks, seen: Observation) -> bool:
    """Tell whether the newest view alone would have decided for one of the places it proposes."""
    if not seen.decides_alone:
        return False
    costs = entering.costs[:, 0]
    places = distinct_places(entering.now, costs, seen.resolution, _COMPARED)
    exponent = exponent_of(seen.beams)
    return float(place_probabilities(costs[places], exponent)[0]) >= ALONE_PROBABILITY
