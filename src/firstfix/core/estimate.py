"""Answers: where the robot may be, how likely, and why."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2


class Verdict(Enum):
    """How far a result can be trusted."""

    UNIQUE = "UNIQUE"
    AMBIGUOUS = "AMBIGUOUS"
    NO_MATCH = "NO_MATCH"


@dataclass(frozen=True, slots=True)
class Evidence:
    """How the beams of a scan agree with the map at one pose; shares of all used beams, 0 to 1.

    Parameters
    ----------
    explained : float
        Beams that end where the map has a wall (or meet nothing where it has none).
    short : float
        Beams that end before the wall: people, furniture; weak evidence against the pose.
    through_wall : float
        Beams that saw through a wall; strong evidence against the pose.
    unknown : float
        Beams that end where the map knows nothing.
    beams : int
        Number of beams used.
    """

    explained: float
    short: float
    through_wall: float
    unknown: float
    beams: int


@dataclass(frozen=True, eq=False, slots=True)
class Hypothesis:
    """One place where the robot may be.

    Parameters
    ----------
    pose : SE2
        ``T_map_base``.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame, given that this is the right place.
    score : float
        Mean cost of a beam; lower is better. Comparable within one result only.
    probability : float
        That this is the right place, 0 to 1; what is missing to 1 over all hypotheses is the
        probability of a place that is not listed.
    evidence : Evidence
        How the beams agree with the map here.
    id : int or None
        Number that a localizer gives to the place and keeps as long as the place is listed; None
        in the answer to a single scan.
    """

    pose: SE2
    covariance: NDArray[np.float64]
    score: float
    probability: float
    evidence: Evidence
    id: int | None = None


@dataclass(frozen=True, slots=True)
class SearchReport:
    """What the search did.

    Parameters
    ----------
    poses : int
        Number of poses the search decided on.
    searched : float
        Share of them that was scored, 0 to 1; less than 1 only with a small ``max_poses``.
    proven : bool
        True if no pose of the search grid has a lower search score than the best one found.
    """

    poses: int
    searched: float
    proven: bool


@dataclass(frozen=True, eq=False, slots=True)
class LocateResult:
    """The answer of the static stage to one scan.

    Parameters
    ----------
    verdict : Verdict
        Whether the best hypothesis may be published.
    reason : str
        The verdict in words, for a person.
    hypotheses : tuple of Hypothesis
        Separated places, most likely first; empty where the scan says nothing.
    search : SearchReport
        What was searched, and whether its optimum is proven.
    elapsed_s : float
        Wall time of the call, s.
    """

    verdict: Verdict
    reason: str
    hypotheses: tuple[Hypothesis, ...]
    search: SearchReport
    elapsed_s: float

    @property
    def best(self) -> Hypothesis | None:
        """The most likely hypothesis; None if there is none."""
        return self.hypotheses[0] if self.hypotheses else None
