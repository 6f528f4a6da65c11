"""One verdict over the places of all maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Verdict
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.sensors import see_enough
from firstfix.global_localization.verdict import judge
from firstfix.site.look import Looked
from firstfix.site.places import SiteCandidates, SitePlace
from firstfix.site.query import SiteQuery
from firstfix.site.result import SiteResult

UNIQUE_PROBABILITY = 0.95
LISTED_PLACES = 24


def judge_site(
    query: SiteQuery, looked: Sequence[Looked], found: Sequence[SiteCandidates]
) -> SiteResult:
    """Decide between all places of all maps.

    Parameters
    ----------
    query : SiteQuery
        What was asked.
    looked : sequence of Looked
        First looks at the parts of the site; at least one.
    found : sequence of SiteCandidates
        What the searches returned.

    Returns
    -------
    SiteResult
        Verdict and ranked hypotheses over all maps.
    """
    seen = Looked.joined(looked)
    ranked = sorted(
        (place for part in found for place in part.places),
        key=lambda place: (-place.log_posterior, place.map_id),
    )
    places, others = _without_copies(ranked)
    if not places:
        return _nothing(query, seen, found)
    shares = seen.recall * _shares(places)
    hypotheses = tuple(
        replace(place.hypothesis, probability=float(share))
        for place, share in zip(places, shares, strict=True)
    )
    verdict, reason = judge(shares, hypotheses[0].evidence, UNIQUE_PROBABILITY)
    if verdict is Verdict.UNIQUE and query.is_one_look and not see_enough(query.scans):
        verdict, reason = Verdict.AMBIGUOUS, f"{reason}, but one scan of this sensor is not enough"
    of_maps: dict[str, float] = dict.fromkeys(seen.map_ids, 0.0)
    for hypothesis in hypotheses:
        of_maps[hypothesis.map_id or ""] += hypothesis.probability
    return SiteResult(
        verdict=verdict,
        reason=reason,
        hypotheses=hypotheses[:LISTED_PLACES],
        same_places=others,
        map_probabilities=of_maps,
        elsewhere=max(0.0, 1.0 - float(shares.sum())),
        searched=tuple(name for part in found for name in part.searched),
        faults=tuple(fault for part in found for fault in part.faults),
        elapsed_s=0.0,
        scans=query.scans,
    )


def _shares(places: Sequence[SitePlace]) -> NDArray[np.float64]:
    """Return the probability of each place against all others and a wrong map."""
    logs = np.array([0.0, *(place.log_posterior for place in places)])
    likelihoods = np.exp(logs - logs.max())
    shares: NDArray[np.float64] = likelihoods[1:] / likelihoods.sum()
    return shares


def _without_copies(
    ranked: Sequence[SitePlace],
) -> tuple[list[SitePlace], dict[int, list[SitePlace]]]:
    """Keep the best of places that are one; return the others by its rank."""
    kept: list[SitePlace] = []
    others: dict[int, list[SitePlace]] = {}
    for place in ranked:
        for rank, better in enumerate(kept):
            if are_one_place(better, place):
                others.setdefault(rank, []).append(place)
                break
        else:
            kept.append(place)
    return kept, others


def are_one_place(a: SitePlace, b: SitePlace) -> bool:
    """Tell whether two places of different maps are the same one in the world."""
    if a.map_id == b.map_id or _apart(a, b):
        return False
    if a.T_site_base is not None and b.T_site_base is not None:
        return is_same_place(a.T_site_base, b.T_site_base)
    return a.content == b.content and is_same_place(a.hypothesis.pose, b.hypothesis.pose)


def _apart(a: SitePlace, b: SitePlace) -> bool:
    """Tell whether two maps are known to show different floors."""
    return any(
        one is not None and other is not None and one != other
        for one, other in zip(a.level, b.level, strict=True)
    )


def _nothing(query: SiteQuery, seen: Looked, found: Sequence[SiteCandidates]) -> SiteResult:
    return SiteResult(
        verdict=Verdict.NO_MATCH,
        reason="the scan has too few beams that measured a surface, or no map could be searched",
        hypotheses=(),
        same_places={},
        map_probabilities=dict.fromkeys(seen.map_ids, 0.0),
        elsewhere=1.0,
        searched=tuple(name for part in found for name in part.searched),
        faults=tuple(fault for part in found for fault in part.faults),
        elapsed_s=0.0,
        scans=query.scans,
    )
