"""May the best place be published? The verdict, and the reason for a person."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.view import Observation, motion
from firstfix.core.estimate import Verdict
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.prior import SHARE_OF_SMALL_VIEW, SHARE_WITHOUT_PRIOR
from firstfix.global_localization.verdict import RIVAL_SHARE, exponent_of, place_probabilities

# Mean cost of a beam up to which a view is explained at a place. The wrong map begins at 2.3.
EXPLAINED_COST = 1.6

# A place that was published stays so while it is more likely than all others together.
STAYING_PROBABILITY = 0.5

# Least probability, by the law of the static stage and by that of views, with which one scan
# decides.
ALONE_PROBABILITY = 0.95

MOST_MISSED = 0.05
"""A place is not sure while places of the map that are not held have more probability."""

# A second decision counts from a view that was taken this far away, or turned by this much.
SECOND_LOOK_M = 0.3
SECOND_LOOK_RAD = math.radians(15.0)


@dataclass(frozen=True, eq=False, slots=True)
class Favourite:
    """A place that has been sure since some view.

    Parameters
    ----------
    id : int
        Of the place.
    since : Observation
        The first view that made it sure.
    published : bool
        True once the verdict has been UNIQUE.
    """

    id: int
    since: Observation
    published: bool


@dataclass(frozen=True, eq=False, slots=True)
class Judgement:
    """A verdict and what it rests on.

    Parameters
    ----------
    verdict : Verdict
        Whether the best place may be published.
    reason : str
        The verdict in words.
    favourite : Favourite or None
        The place that is sure, if one is.
    unexplained : bool
        True if the best place does not explain the newest view.
    is_new : bool
        True if the place may be published and was not before.
    """

    verdict: Verdict
    reason: str
    favourite: Favourite | None
    unexplained: bool = False
    is_new: bool = False


@dataclass(frozen=True, slots=True)
class Rule:
    """What makes a place sure.

    Parameters
    ----------
    probability : float
        Least share of what is held.
    hinted : bool
        True if a prior speaks for the best place: then one view is enough.
    evidence : float
        Probability of the best place with the priors of programs left out; 1 without such a prior.
    missed : float
        Probability of the places of the map that are not held.
    """

    probability: float
    hinted: bool
    evidence: float = 1.0
    missed: float = 0.0

    @property
    def held(self) -> float:
        """Probability of all that is held, or that no map explains."""
        return 1.0 - self.missed


def judge(
    costs: NDArray[np.float64],
    ids: NDArray[np.int64],
    probabilities: NDArray[np.float64],
    window: Sequence[Observation],
    before: Favourite | None,
    rule: Rule,
) -> Judgement:
    """Decide what a person, or a robot, may do with the best place.

    A place is sure if its probability is high and it explains the newest view. It is published if
    it stays sure in a second view from elsewhere; at once if a sensor that sees much is sure by its
    newest scan alone, or if a prior speaks for it.

    Parameters
    ----------
    costs : ndarray, shape (n, v)
        Mean cost of a beam of each place at each view.
    ids : ndarray of int64, shape (n,)
        Of the places, most likely first.
    probabilities : ndarray, shape (n,)
        Of the places.
    window : sequence of Observation
        The views, oldest first.
    before : Favourite or None
        The favourite of the view before.
    rule : Rule
        What makes a place sure.

    Returns
    -------
    Judgement
        The verdict and its reason.
    """
    seen = window[-1]
    if len(ids) == 0 or probabilities.sum() + rule.missed < 0.5:
        return Judgement(Verdict.NO_MATCH, _nowhere(len(window)), None, unexplained=True)
    known = before if before is not None and before.id == ids[0] else None
    stays = known is not None and known.published and probabilities[0] >= STAYING_PROBABILITY
    if costs[0, -1] > EXPLAINED_COST:
        reason = "the most likely place does not explain the latest view"
        kept = known if stays else None
        return Judgement(Verdict.AMBIGUOUS, reason, kept, unexplained=True)
    alone = seen.decides_alone and _alone(costs[:, -1], seen.beams) >= ALONE_PROBABILITY
    # A first view is judged by the law of single scans, which is known well, and is less strict.
    least = ALONE_PROBABILITY if alone and len(window) == 1 else rule.probability
    if not stays and (rule.missed > MOST_MISSED or probabilities[0] < least * rule.held):
        return Judgement(Verdict.AMBIGUOUS, _undecided(probabilities, rule, len(window)), None)

    if not stays and rule.evidence < SHARE_WITHOUT_PRIOR:
        return Judgement(Verdict.AMBIGUOUS, _chosen_by_prior(probabilities, rule), None)
    one_view = SHARE_WITHOUT_PRIOR if seen.decides_alone else SHARE_OF_SMALL_VIEW
    hinted = rule.hinted and rule.evidence >= one_view
    published = alone or hinted or (known is not None and _confirmed(known, seen))
    since = seen if known is None else known.since
    favourite = Favourite(int(ids[0]), since, published)
    if published:
        is_new = known is None or not known.published
        reason = _sure(len(window), hinted=hinted)
        return Judgement(Verdict.UNIQUE, reason, favourite, is_new=is_new)
    reason = (
        f"one place has {probabilities[0]:.0%} of the probability, but this sensor needs a second "
        f"view to be sure: drive {SECOND_LOOK_M} m or turn {math.degrees(SECOND_LOOK_RAD):.0f}°"
    )
    return Judgement(Verdict.AMBIGUOUS, reason, favourite)


def withheld(judgement: Judgement) -> Judgement:
    """Return the judgement of a place that is ahead of another by one thing only."""
    assert judgement.favourite is not None  # noqa: S101 - it is sure
    reason = (
        "one place fits best, but another would fit as well but for one thing, which may have been "
        "moved; motion may tell them apart"
    )
    return Judgement(Verdict.AMBIGUOUS, reason, replace(judgement.favourite, published=False))


def _alone(newest: NDArray[np.float64], beams: Beams) -> float:
    """Return the probability of the best place by the newest view alone."""
    return float(place_probabilities(newest, exponent_of(beams))[0])


def _confirmed(known: Favourite, seen: Observation) -> bool:
    path, turn = motion(known.since, seen)
    far = path * seen.resolution >= SECOND_LOOK_M - 1e-9
    return known.published or far or turn >= SECOND_LOOK_RAD


def _chosen_by_prior(probabilities: NDArray[np.float64], rule: Rule) -> str:
    return (
        f"the prior chooses this place ({probabilities[0]:.0%} likely with it, {rule.evidence:.0%} "
        "by the views alone); motion may confirm it"
    )


def _sure(views: int, *, hinted: bool) -> str:
    if hinted:
        return "the scan confirms the place that was given, and nowhere else fits nearly as well"
    which = "the scan fits" if views == 1 else f"the latest {views} views fit"
    return f"{which} here and nowhere else nearly as well"


def _undecided(probabilities: NDArray[np.float64], rule: Rule, views: int) -> str:
    rivals = int(np.count_nonzero(probabilities >= RIVAL_SHARE * probabilities[0]))
    which = "the view" if views == 1 else f"the latest {views} views"
    if rivals > 1:
        return f"{rivals} places explain {which} about as well; motion may tell them apart"
    if probabilities[0] >= rule.probability * rule.held:
        return (
            f"one place explains {which} best, but not so well that it must be the right one: "
            f"{rule.missed:.0%} is left to places that are not listed"
        )
    return f"one place explains {which} best, but others not badly enough to be sure"


def _nowhere(views: int) -> str:
    which = "the view" if views == 1 else f"the latest {views} views"
    return f"no place of the map explains {which}: wrong map, unmapped place or blocked sensor"
