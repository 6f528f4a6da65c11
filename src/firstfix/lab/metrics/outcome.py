"""Answers to single scans, compared with the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass

from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2

NO_POSE = PoseError(math.inf, math.inf)
FOUND = PoseError(0.5, math.radians(10.0))
FOUND_WELL = PoseError(0.2, math.radians(3.0))


@dataclass(frozen=True, slots=True)
class Answer:
    """What a method says of one scan.

    Parameters
    ----------
    poses : tuple of SE2
        ``T_map_base``, best first; empty if nothing was found.
    probability : float
        Of the first pose, 0 to 1.
    verdict : Verdict
        UNIQUE if the first pose may be published.
    """

    poses: tuple[SE2, ...]
    probability: float
    verdict: Verdict

    @classmethod
    def of(cls, result: LocateResult) -> Answer:
        """Return what a result says."""
        probability = result.best.probability if result.best is not None else 0.0
        return cls(tuple(place.pose for place in result.hypotheses), probability, result.verdict)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The answer to one scan, compared with the truth.

    Parameters
    ----------
    index : int
        Index of the scan in its recording.
    verdict : Verdict
        The verdict.
    error : PoseError
        Of the best hypothesis.
    rank : int or None
        Rank of the first hypothesis within `FOUND` of the truth, from 1; None if there is none.
    cpu_s, wall_s : float
        Processor and wall time of ``locate``, s.
    probability : float
        Of the best hypothesis, 0 to 1; 0 if there is none.
    """

    index: int
    verdict: Verdict
    error: PoseError
    rank: int | None
    cpu_s: float
    wall_s: float
    probability: float

    @property
    def is_found(self) -> bool:
        """True if the best hypothesis is within `FOUND` of the truth, whatever the verdict."""
        return self.error.is_within(FOUND)


def is_found(pose: SE2, truth: SE2 | None) -> bool:
    """Return whether a pose is within `FOUND` of the truth; False if the truth is unknown."""
    return truth is not None and PoseError.between(pose, truth).is_within(FOUND)


def judge(answer: Answer, truth: SE2, *, index: int, cpu_s: float, wall_s: float) -> Outcome:
    """Compare an answer with the true ``T_map_base``, whatever its verdict; times in s."""
    errors = [PoseError.between(pose, truth) for pose in answer.poses]
    ranks = [rank for rank, error in enumerate(errors, 1) if error.is_within(FOUND)]
    return Outcome(
        index,
        answer.verdict,
        errors[0] if errors else NO_POSE,
        ranks[0] if ranks else None,
        cpu_s,
        wall_s,
        answer.probability,
    )
