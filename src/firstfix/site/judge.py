"""One verdict over the places of all maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.config import BeliefConfig
from firstfix.belief.judge import (
    ALONE_PROBABILITY,
    EXPLAINED_COST,
    SECOND_LOOK_M,
    SECOND_LOOK_RAD,
)
from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan
from firstfix.global_localization.lead import RIVALS, leads_without_its_best_part
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.prior import NEAR_LOG
from firstfix.global_localization.sensors import joint_beams, see_enough
from firstfix.global_localization.verdict import (
    DIFFERS_IN_LITTLE,
    EXPONENT,
    RIVAL_SHARE,
    SEES_TOO_LITTLE,
    exponent_of,
    judge,
    place_probabilities,
)
from firstfix.site.look import Looked
from firstfix.site.places import SiteCandidates, SitePlace
from firstfix.site.query import SiteQuery
from firstfix.site.result import SiteResult
from firstfix.site.surroundings import are_alike, show_the_same
from firstfix.site.views import has_moved, views_of

# Least probability for UNIQUE: of one look as in `LocateConfig`, of several views as in the belief.
UNIQUE_PROBABILITY = 0.95
SURE_PROBABILITY = BeliefConfig().sure_probability

# One look decides between maps by the power law of the verdict on the best cost of each, with this
# exponent, and within a map by the law itself, whose exponent is 12: places of one map share its
# errors, those of another do not. So no place is surer than in its map alone (0021).
MAP_EXPONENT = 14.0

# Share of the maps that a look misses which the look at the next view misses, too (0026).
MISSED_AGAIN = 0.5

LISTED_PLACES = 24

_NOTHING = (
    "too few beams measured a surface: blocked sensor, open space, or limits range_min and "
    "range_max that do not fit it"
)
_NO_MAP = "no map of the site can be searched"
_SEEN_ONCE = (
    f"but this sensor needs a second view to be sure: drive {SECOND_LOOK_M} m or turn "
    f"{np.degrees(SECOND_LOOK_RAD):.0f}°"
)


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
    places, copies = _without_copies(ranked)
    if not places:
        searched = any(part.searched for part in found)
        return _result(query, seen, found, Verdict.NO_MATCH, _NOTHING if searched else _NO_MAP)
    if query.is_one_look:
        shares = seen.recall * _shares_of_look(places)[:, None]
    else:
        recall = 1.0 - (1.0 - seen.recall) * MISSED_AGAIN
        shares = recall * _shares_of_views(places, copies, found)
    order = np.argsort(-shares[:, -1], kind="stable").tolist()
    places, copies, shares = [places[i] for i in order], [copies[i] for i in order], shares[order]
    hypotheses = [
        replace(place.hypothesis, probability=float(share))
        for place, share in zip(places, shares[:, -1], strict=True)
    ]
    judged = _judge_look if query.is_one_look else _judge_views
    verdict, reason = judged(query, places, shares)
    if verdict is Verdict.UNIQUE:
        verdict, reason = _checked_against_prior(places, reason)
    return replace(
        _result(query, seen, found, verdict, reason),
        hypotheses=tuple(hypotheses[:LISTED_PLACES]),
        same_places=tuple(map(tuple, copies[:LISTED_PLACES])),
        map_probabilities={
            name: sum(h.probability for h in hypotheses if h.map_id == name)
            for name in seen.map_ids
        },
        elsewhere=max(0.0, 1.0 - float(shares[:, -1].sum())),
    )


def _shares_of_look(places: Sequence[SitePlace]) -> NDArray[np.float64]:
    """Return the probability of each place after one look, shape (n,): of its map, and in it."""
    ratio = MAP_EXPONENT / EXPONENT
    names = [place.map_id for place in places]
    inside = {
        name: _normalised([p.log_posterior for p in places if p.map_id == name])
        for name in dict.fromkeys(names)
    }
    best = {
        name: max(ratio * p.log_likelihood + p.prior_log for p in places if p.map_id == name)
        for name in inside
    }
    of_maps = dict(zip(best, _normalised([*best.values()]), strict=True))
    rest = {name: iter(shares) for name, shares in inside.items()}
    return np.array([of_maps[name] * next(rest[name]) for name in names])


def _normalised(logs: Sequence[float]) -> NDArray[np.float64]:
    """Turn log-likelihoods into probabilities; a wrong map has 0, and the rest to 1."""
    all_logs = np.array([0.0, *logs])
    likelihoods = np.exp(all_logs - all_logs.max())
    shares: NDArray[np.float64] = likelihoods[1:] / likelihoods.sum()
    return shares


def _shares_of_views(
    places: Sequence[SitePlace],
    copies: Sequence[Sequence[SitePlace]],
    found: Sequence[SiteCandidates],
) -> NDArray[np.float64]:
    """Return the probability of each place after each view, shape (n, steps).

    Against all other places of all maps, listed or not, and a wrong map. A copy is no other place.
    """
    logs = np.array([place.steps for place in places])
    totals = np.array([part.totals for part in found if len(part.totals)])
    most = np.maximum(0.0, np.maximum(logs.max(axis=0), totals.max(axis=0)))
    mass = np.exp(-most) + np.exp(totals - most).sum(axis=0)
    for other in chain.from_iterable(copies):
        mass -= np.exp(np.array(other.steps) - most)
    likelihoods = np.exp(logs - most)
    # Where nearly all was copies, what is left of the mass is rounding.
    shares: NDArray[np.float64] = likelihoods / np.maximum(mass, likelihoods.sum(axis=0))
    return shares


def _judge_look(
    query: SiteQuery, places: Sequence[SitePlace], shares: NDArray[np.float64]
) -> tuple[Verdict, str]:
    verdict, reason = judge(shares[:, -1], places[0].hypothesis.evidence, UNIQUE_PROBABILITY)
    if verdict is not Verdict.UNIQUE or _is_hinted(query, places[0]):
        return verdict, reason
    if not see_enough(query.scans):
        return Verdict.AMBIGUOUS, f"{reason}, {SEES_TOO_LITTLE}"
    if not _leads_clearly(places[:RIVALS]):
        return Verdict.AMBIGUOUS, f"{reason}, {DIFFERS_IN_LITTLE}"
    return verdict, reason


def _leads_clearly(places: Sequence[SitePlace]) -> bool:
    """Tell whether the first place leads not only by one thing that may have been moved."""
    best = places[0].part_costs
    return leads_without_its_best_part(
        np.array([place.part_costs for place in places if len(place.part_costs) == len(best)])
    )


def _judge_views(
    query: SiteQuery, places: Sequence[SitePlace], shares: NDArray[np.float64]
) -> tuple[Verdict, str]:
    """Decide by the rule of the belief: sure in two views from different poses."""
    views, best, now = views_of(query), shares[0], shares[:, -1]
    if now.sum() < 0.5:
        return Verdict.NO_MATCH, f"no place of any map explains the {len(views)} views"
    if places[0].cost > EXPLAINED_COST:
        return Verdict.AMBIGUOUS, "the most likely place does not explain the latest view"
    if best[-1] < SURE_PROBABILITY:
        rivals = int(np.count_nonzero(now >= RIVAL_SHARE * now[0]))
        return Verdict.AMBIGUOUS, f"{rivals} places explain the views about as well"
    unsure = np.flatnonzero(best < SURE_PROBABILITY)
    since = views[int(unsure[-1]) + 1 if len(unsure) else 0]
    if (
        has_moved(since, views[-1], SECOND_LOOK_M, SECOND_LOOK_RAD)
        or _is_hinted(query, places[0])
        or _decides_alone(views[-1].scans, places)
    ):
        reason = f"{len(views)} views fit here and nowhere else nearly as well"
        if not _is_hinted(query, places[0]) and not _leads_clearly(_with_twins(places)):
            return Verdict.AMBIGUOUS, f"{len(views)} views fit best here, {DIFFERS_IN_LITTLE}"
        return Verdict.UNIQUE, reason
    return Verdict.AMBIGUOUS, f"one place has {best[-1]:.0%} of the probability, {_SEEN_ONCE}"


def _with_twins(places: Sequence[SitePlace]) -> list[SitePlace]:
    """Return the first place, and the best ones of maps that show nearly the same there."""
    best = places[0]
    return [
        best,
        *(
            place
            for place in places
            if place.map_id != best.map_id
            and place.part_costs
            and place.around is not None
            and best.around is not None
            and are_alike(place.around, best.around)
        ),
    ]


def _decides_alone(scans: Sequence[LaserScan], places: Sequence[SitePlace]) -> bool:
    """Tell whether the newest view of a sensor that sees much is enough."""
    costs = np.array([place.cost for place in places])
    alone = place_probabilities(costs, exponent_of(joint_beams(scans)[1]))
    return see_enough(scans) and bool(alone[0] >= ALONE_PROBABILITY)


def _is_hinted(query: SiteQuery, place: SitePlace) -> bool:
    """Tell whether a prior of the pose, not only of the map, speaks for a place."""
    return query.prior_in(place.map_id) is not None and place.prior_log >= NEAR_LOG


def _checked_against_prior(places: Sequence[SitePlace], reason: str) -> tuple[Verdict, str]:
    """Let nothing decide where the scans clearly fit better outside the prior."""
    favourite = max(places, key=lambda place: place.log_likelihood)
    ratio = np.exp(places[0].log_likelihood - favourite.log_likelihood)
    if ratio >= RIVAL_SHARE:
        return Verdict.UNIQUE, reason
    return (
        Verdict.AMBIGUOUS,
        f"the scan fits {1.0 / ratio:.0f} times better in {favourite.map_id} than near the prior",
    )


def _without_copies(
    ranked: Sequence[SitePlace],
) -> tuple[list[SitePlace], list[list[SitePlace]]]:
    """Keep the best of places that are one, and return the others of each."""
    kept: list[SitePlace] = []
    copies: list[list[SitePlace]] = []
    for place in ranked:
        for better, others in zip(kept, copies, strict=True):
            if are_one_place(better, place):
                others.append(place)
                break
        else:
            kept.append(place)
            copies.append([])
    return kept, copies


def are_one_place(a: SitePlace, b: SitePlace) -> bool:
    """Tell whether places of two maps are one in the world."""
    if a.map_id == b.map_id or _apart(a, b):
        return False
    if a.T_site_base is not None and b.T_site_base is not None:
        return is_same_place(a.T_site_base, b.T_site_base)
    if a.content == b.content:
        return is_same_place(a.hypothesis.pose, b.hypothesis.pose)
    return a.around is not None and b.around is not None and show_the_same(a.around, b.around)


def _apart(a: SitePlace, b: SitePlace) -> bool:
    """Tell whether two maps are known to show different floors."""
    return any(
        one is not None and other is not None and one != other
        for one, other in zip(a.level, b.level, strict=True)
    )


def _result(
    query: SiteQuery,
    seen: Looked,
    found: Sequence[SiteCandidates],
    verdict: Verdict,
    reason: str,
) -> SiteResult:
    """Return a result without places."""
    return SiteResult(
        verdict=verdict,
        reason=reason,
        hypotheses=(),
        same_places=(),
        map_probabilities=dict.fromkeys(seen.map_ids, 0.0),
        elsewhere=1.0,
        searched=tuple(name for part in found for name in part.searched),
        faults=tuple(fault for part in found for fault in part.faults),
        elapsed_s=0.0,
        scans=query.scans,
    )
