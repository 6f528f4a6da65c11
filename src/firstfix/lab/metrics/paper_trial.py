"""Attempts to find a robot that wakes up, judged by the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2
from firstfix.lab.metrics.outcome import is_found

# A pose that is right in passing is not right: it must have been so for the last seconds.
STAYS_S = 5.0

# Longer than a filter needs to narrow around a pose that was given to it.
MISLED_S = 1.0

NO_CLOUD: NDArray[np.float64] = np.empty((0, 3))


class Start(Enum):
    """How a robot comes by its first pose; the values are the words of tables."""

    BY_HAND = "by hand"
    DEFAULT_POSE = "default pose"
    UNIFORM = "uniform"
    PAPER = "paper"
    FAST = "fast"
    SYSTEM = "system"


WORDS = {
    Start.BY_HAND: "a person points at the map (sigma 0.3 m, 10°), then AMCL",
    Start.DEFAULT_POSE: "AMCL begins at (0, 0, 0), as ROS does",
    Start.UNIFORM: "AMCL begins with particles over all free space",
    Start.PAPER: "the paper's static stage gives the pose of the first scan to AMCL",
    Start.FAST: "the default static stage gives AMCL the pose of the first scan that is UNIQUE",
    Start.SYSTEM: "the whole system (`Localizer`): several places are followed until one has won",
}


@dataclass(frozen=True, slots=True)
class Belief:
    """The true and the estimated pose at one scan.

    Parameters
    ----------
    stamp : float
        Time, s.
    truth : SE2
        ``T_map_base``.
    T_map_base : SE2 or None
        The estimate.
    sure : bool
        True if a robot would act upon the estimate.
    cpu_s : float
        Processor time of this scan, s.
    """

    stamp: float
    truth: SE2
    T_map_base: SE2 | None
    sure: bool
    cpu_s: float


@dataclass(frozen=True, eq=False, slots=True)
class Attempt:
    """One drive with one kind of start.

    Parameters
    ----------
    start : Start
        The kind of start.
    prepare_s : float
        Processor time of preparing the map, s.
    beliefs : tuple of Belief
        One for each scan.
    first_cloud, last_cloud : ndarray, shape (n, 3)
        Some of the particles at the beginning and at the end: x (m), y (m), yaw (rad).
    """

    start: Start
    prepare_s: float
    beliefs: tuple[Belief, ...]
    first_cloud: NDArray[np.float64]
    last_cloud: NDArray[np.float64]


class Ending(Enum):
    """How an attempt ended."""

    RIGHT = "right"
    WRONG = "wrong"
    OPEN = "open"


@dataclass(frozen=True, slots=True)
class Trial:
    """One attempt, judged.

    Parameters
    ----------
    world : str
        The building.
    seed : int
        Of the drive.
    start : Start
        The way.
    ending : Ending
        RIGHT: within 0.5 m and 10° of the truth at the end, and for `STAYS_S` before. WRONG: sure
        of another place. OPEN: neither.
    time_s, driven_m : float or None
        Until the pose was right for good, s and m; None if it was not.
    misled_s : float
        For how long it was sure of a wrong pose, s.
    start_cpu_s : float
        Processor time for the map and for all scans up to the first pose, s.
    cpu_ms_per_scan : float
        Processor time of a later scan, mean, ms.
    """

    world: str
    seed: int
    start: Start
    ending: Ending
    time_s: float | None
    driven_m: float | None
    misled_s: float
    start_cpu_s: float
    cpu_ms_per_scan: float


def judge_attempt(world: str, seed: int, attempt: Attempt) -> Trial:
    """Compare the estimates of an attempt, at least one, with the true poses."""
    beliefs = attempt.beliefs
    settled = _settled(beliefs)
    steps = [a.truth.distance_to(b.truth) for a, b in pairwise(beliefs)]
    known = [i for i, belief in enumerate(beliefs) if belief.T_map_base is not None]
    first = known[0] if known else len(beliefs) - 1
    cpu_s = [belief.cpu_s for belief in beliefs]
    later = cpu_s[first + 1 :]
    ending = Ending.WRONG if _is_misled(beliefs[-1]) else Ending.OPEN
    return Trial(
        world=world,
        seed=seed,
        start=attempt.start,
        ending=ending if settled is None else Ending.RIGHT,
        time_s=None if settled is None else beliefs[settled].stamp - beliefs[0].stamp,
        driven_m=None if settled is None else float(sum(steps[:settled])),
        misled_s=_misled_s(beliefs),
        start_cpu_s=attempt.prepare_s + sum(cpu_s[: first + 1]),
        cpu_ms_per_scan=1e3 * sum(later) / len(later) if later else 0.0,
    )


def _settled(beliefs: Sequence[Belief]) -> int | None:
    """Return the scan from which on the pose is right, if that is long enough before the end."""
    wrong = [i for i, belief in enumerate(beliefs) if not _is_right(belief)]
    settled = wrong[-1] + 1 if wrong else 0
    if settled == len(beliefs):
        return None
    stayed = beliefs[-1].stamp - beliefs[settled].stamp
    return settled if stayed >= STAYS_S or not wrong else None


def _is_right(belief: Belief) -> bool:
    return belief.T_map_base is not None and is_found(belief.T_map_base, belief.truth)


def _is_misled(belief: Belief) -> bool:
    return belief.sure and not _is_right(belief)


def _misled_s(beliefs: Sequence[Belief]) -> float:
    return math.fsum(
        after.stamp - before.stamp for before, after in pairwise(beliefs) if _is_misled(before)
    )
