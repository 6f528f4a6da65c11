"""The first look: how promising each map is."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.scan import LaserScan
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS, Beams
from firstfix.global_localization.look import look_into
from firstfix.global_localization.sensors import joint_beams
from firstfix.site.maps import Maps
from firstfix.site.query import SiteQuery
from firstfix.site.views import views_of

PROMISING = 40
"""Maps that are searched after a first look at more."""

RECALL = 0.97
"""Probability that a look keeps the right place and map (docs/decisions/0022)."""

LOOKS = 3
"""Views that a first look uses, at most."""

# More than any difference of scores, m.
_NAMED = 1e3

# Score of a map without a promising place, m: worse than any other.
_NOTHING = 1e2


@dataclass(frozen=True, eq=False)
class Looked:
    """What a first look at maps says. Can be pickled.

    Parameters
    ----------
    map_ids : tuple of str
        The maps that were looked at.
    scores : ndarray, shape (n,)
        Score of the best position of each, m; lower is better.
    recall : float
        Probability that the right map is among `promising`, measured on other buildings.
    most : int
        Number of maps in `promising`; may be more than there are in this part of the site.
    """

    map_ids: tuple[str, ...]
    scores: NDArray[np.float64]
    recall: float
    most: int

    @property
    def promising(self) -> tuple[str, ...]:
        """The maps that are worth a search, best first."""
        order = np.argsort(self.scores, kind="stable")[: self.most]
        return tuple(self.map_ids[i] for i in order)

    @classmethod
    def joined(cls, parts: Sequence[Looked]) -> Looked:
        """Put the looks at parts of a site together.

        Parameters
        ----------
        parts : sequence of Looked
            At different maps of one site; at least one.
        """
        map_ids = tuple(name for part in parts for name in part.map_ids)
        most = max(part.most for part in parts)
        return cls(
            map_ids=map_ids,
            scores=np.concatenate([part.scores for part in parts]),
            recall=1.0 if len(map_ids) <= PROMISING else min(part.recall for part in parts),
            most=most,
        )


def look_at_all(map_ids: Sequence[str]) -> Looked:
    """Find every map promising; the search itself looks first."""
    recall = 1.0 if len(map_ids) <= PROMISING else RECALL
    return Looked(tuple(map_ids), np.zeros(len(map_ids)), recall, most=sys.maxsize)


def look_at_maps(query: SiteQuery, map_ids: Sequence[str], maps: Maps) -> Looked:
    """Rank maps by the best place of each that a first look finds.

    Parameters
    ----------
    query : SiteQuery
        What is asked. Of several views the mean score of `LOOKS` counts: a sensor that sees little
        needs more than one.
    map_ids : sequence of str
        The maps; all can be loaded.
    maps : callable
        Loads a map by its id.
    """
    looks = [beams for scans in _scans_of_looks(query) if (beams := _enough(scans)) is not None]
    if not looks or not map_ids:
        return look_at_all(map_ids)
    fields = [maps(map_id).fields for map_id in map_ids]
    scores = np.mean([_best_scores(beams, fields) for beams in looks], axis=0)
    if query.prior is not None:  # a map that is named is never left out
        scores -= np.array([_NAMED if name in query.prior else 0.0 for name in map_ids])
    return Looked(tuple(map_ids), scores, recall=RECALL, most=PROMISING)


def _scans_of_looks(query: SiteQuery) -> list[tuple[LaserScan, ...]]:
    """Return the scans of one look, or those of some views, evenly chosen, with the newest."""
    if query.is_one_look:
        return [query.scans]
    views = views_of(query)
    index = np.unique(np.linspace(len(views) - 1, 0, LOOKS).round().astype(np.int64))
    return [views[i].scans for i in index.tolist()]


def _enough(scans: Sequence[LaserScan]) -> Beams | None:
    """Return the beams of a look; None if too few measured a surface."""
    _, beams = joint_beams(scans)
    return beams if int(np.count_nonzero(beams.hit)) >= FEWEST_HITS else None


def _best_scores(beams: Beams, fields: Sequence[MapFields]) -> NDArray[np.float64]:
    """Return the score of the best place of each map, shape (n,), m."""
    return np.array([found.scores.min(initial=_NOTHING) for found in look_into(beams, fields, 1)])
