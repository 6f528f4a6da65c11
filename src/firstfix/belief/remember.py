"""Which views stay when a new one comes: the latest, and older ones that are far apart."""

from __future__ import annotations

from collections.abc import Sequence

from firstfix.belief.config import BeliefConfig
from firstfix.belief.evidence import novelty
from firstfix.belief.view import Observation

# Of rounding.
_EPS = 1e-9


def remembered(window: Sequence[Observation], config: BeliefConfig) -> list[int]:
    """Choose the views that stay before a new one is added.

    A robot that drives along a corridor learns little from its latest views, which cover two
    metres. Of the older ones those stay that are independent of each other.

    Parameters
    ----------
    window : sequence of Observation
        The views, oldest first.
    config : BeliefConfig
        How many stay.

    Returns
    -------
    list of int
        Indices, in their order: the latest `window` - 1 views, and at most `memory` older ones.
    """
    latest = max(0, len(window) - (config.window - 1))
    older: list[int] = []
    for i in range(latest):
        if not older or novelty((window[older[-1]], window[i]))[0] >= 1.0 - _EPS:
            older.append(i)
    kept = older[max(0, len(older) - config.memory) :] if config.memory else []
    return [*kept, *range(latest, len(window))]
