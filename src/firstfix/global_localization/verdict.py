"""Probabilities of places, and the verdict."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Evidence, LocateResult, SearchReport, Verdict
from firstfix.global_localization.beams import Beams

# The noise of a scan in a map (people, moved chairs, an imprecise drawing) is unknown beforehand.
# Marginalised over this unknown scale (as Student's t comes from Gauss), the likelihood of a place
# is a power of its mean cost: the ratio of two costs counts, not their difference. The exponent is
# half the number of independent measurements in a scan, fewer if it has few beams, more if several
# sensors see the same things from different places; the floor is the cost of sensor noise alone.
# docs/decisions/0005 has the measurements.
EXPONENT = 12.0
_BEAMS_FOR_EXPONENT = 30
FLOOR = 0.2

# An answer with fewer beams explained comes with a warning.
_DOUBTFUL_FIT = 0.6

# Mean cost at which the best place of a wrong map begins to be as good as the right one.
WRONG_MAP_COST = 2.3

# Why one scan is not enough, after the reason for which it would be.
SEES_TOO_LITTLE = (
    "but one scan of a sensor with this field of view and range is not enough to be sure: "
    "drive half a metre or turn, and give several scans"
)
DIFFERS_IN_LITTLE = (
    "but only by one or two things, which may have been moved: "
    "drive or turn, and give several scans"
)

# A place at least this fraction as likely as the best one is its rival.
RIVAL_SHARE = 0.1


def exponent_of(beams: Beams) -> float:
    """Return the exponent of the law for a scan, or for one of each sensor of a robot.

    Parameters
    ----------
    beams : Beams
        Behind a mean cost. Sensors that see the same things are several witnesses, but not
        independent ones: the root of their turns counts.
    """
    enough = min(1.0, len(beams) / _BEAMS_FOR_EXPONENT)
    return EXPONENT * enough * math.sqrt(max(1.0, beams.turns))


def place_probabilities(scores: NDArray[np.float64], exponent: float) -> NDArray[np.float64]:
    """Turn the costs of separate places into probabilities.

    Parameters
    ----------
    scores : ndarray, shape (n,)
        Mean cost of a beam at each place, nats.
    exponent : float
        Of `exponent_of`.

    Returns
    -------
    ndarray, shape (n,)
        Probability of each place; the rest to 1 is the probability of a place that is not listed.
    """
    logs = log_likelihoods(np.append(scores, WRONG_MAP_COST), exponent)
    likelihoods: NDArray[np.float64] = np.exp(logs - logs.max())
    likelihoods /= likelihoods.sum()
    return likelihoods[:-1]


def with_prior(
    scores: NDArray[np.float64], logs: NDArray[np.float64], exponent: float
) -> NDArray[np.float64]:
    """Return the costs whose likelihoods are those of the scan times those of a prior.

    Parameters
    ----------
    scores : ndarray, shape (n,)
        Mean cost of a beam at each place, nats.
    logs : ndarray, shape (n,)
        Log-likelihood of each place by the prior.
    exponent : float
        Of `exponent_of`.
    """
    costs: NDArray[np.float64] = (scores + FLOOR) * np.exp(-logs / exponent) - FLOOR
    return costs


def log_likelihoods(scores: NDArray[np.float64], exponent: float) -> NDArray[np.float64]:
    """Turn mean costs into log-likelihoods, up to a constant.

    Parameters
    ----------
    scores : ndarray, shape (n,)
        Mean cost of a beam at each place, nats.
    exponent : float
        Of `exponent_of`.

    Returns
    -------
    ndarray, shape (n,)
        Natural logarithms.
    """
    logs: NDArray[np.float64] = -exponent * np.log(scores + FLOOR)
    return logs


def judge(
    probabilities: NDArray[np.float64], best: Evidence, unique_probability: float
) -> tuple[Verdict, str]:
    """Decide whether the best place may be published.

    Parameters
    ----------
    probabilities : ndarray, shape (n,)
        Of the places, most likely first; at least one.
    best : Evidence
        Of the most likely place.
    unique_probability : float
        Least probability for UNIQUE.

    Returns
    -------
    Verdict
        UNIQUE, AMBIGUOUS, or NO_MATCH if no place is more likely than all of them.
    str
        The reason in words.
    """
    fit = f"{best.explained:.0%} of {best.beams} beams fit"
    if probabilities[0] >= unique_probability:
        return Verdict.UNIQUE, f"{fit} here and nowhere else nearly as well"
    nowhere = 1.0 - float(probabilities.sum())
    if nowhere > 0.5:
        against = "see through its walls" if best.through_wall > best.short else "end elsewhere"
        reason = (
            f"even at the best place only {fit} and the others {against}: "
            "wrong map, unmapped place or blocked sensor"
        )
        return Verdict.NO_MATCH, reason
    rivals = count_rivals(probabilities)
    doubt = "; perhaps the wrong map" if best.explained < _DOUBTFUL_FIT else ""
    if rivals > 1:
        reason = f"{rivals} places fit about equally well{doubt}"
    elif nowhere > 1.0 - unique_probability:
        reason = f"{fit} at the best place, too few to be sure{doubt}"
    else:
        reason = f"{fit} at the best place; other places fit worse but are not excluded{doubt}"
    return Verdict.AMBIGUOUS, reason


def count_rivals(probabilities: NDArray[np.float64]) -> int:
    """Count the places that fit about as well as the most likely one, which is included."""
    return int(np.count_nonzero(probabilities >= RIVAL_SHARE * probabilities.max(initial=0.0)))


def nothing_to_match(beams: int, hits: int, needed: int, elapsed_s: float) -> LocateResult:
    """Return NO_MATCH for valid scans with too few hits."""
    return LocateResult(
        verdict=Verdict.NO_MATCH,
        reason=f"only {hits} of {beams} beams measured a surface, {needed} are needed: "
        "blocked sensor, open space, or limits range_min and range_max that do not fit it",
        hypotheses=(),
        search=SearchReport(poses=0, searched=0.0, proven=False),
        elapsed_s=elapsed_s,
    )
