"""The first look: how promising each map is."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.scan import LaserScan
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.look import look_into
from firstfix.global_localization.sensors import joint_beams
from firstfix.site.maps import Maps
from firstfix.site.query import SiteQuery

PROMISING = 40
"""Maps that are searched after a first look at more."""

RECALL = 0.99
"""Probability that the right map is among them (docs/decisions/0022)."""

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
            recall=1.0 if len(map_ids) <= most else min(part.recall for part in parts),
            most=most,
        )


def look_at_all(map_ids: Sequence[str]) -> Looked:
    """Find every map promising."""
    return Looked(tuple(map_ids), np.zeros(len(map_ids)), recall=1.0, most=sys.maxsize)


def look_at_maps(query: SiteQuery, map_ids: Sequence[str], maps: Maps) -> Looked:
    """Rank maps by the best place of each that a first look finds.

    Parameters
    ----------
    query : SiteQuery
        What is asked. Of several views the newest counts.
    map_ids : sequence of str
        The maps; all can be loaded.
    maps : callable
        Loads a map by its id.
    """
    _, beams = joint_beams(newest_scans(query))
    if int(np.count_nonzero(beams.hit)) < FEWEST_HITS or not map_ids:
        return look_at_all(map_ids)
    found = look_into(beams, [maps(map_id).fields for map_id in map_ids], 1)
    scores = np.array([of_map.scores.min(initial=_NOTHING) for of_map in found])
    if query.prior is not None:  # a map that is named is never left out
        scores -= np.array([_NAMED if name in query.prior else 0.0 for name in map_ids])
    return Looked(tuple(map_ids), scores, recall=RECALL, most=PROMISING)


def newest_scans(query: SiteQuery) -> tuple[LaserScan, ...]:
    """Return the scans of the newest time of a query."""
    newest = max(scan.stamp for scan in query.scans)
    if query.is_one_look:
        return query.scans
    return tuple(scan for scan in query.scans if scan.stamp == newest) or query.scans[-1:]
