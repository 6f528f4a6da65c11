"""Kidnaps judged: detected, recovered, or a wrong pose published."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from firstfix.core.estimate import Hypothesis
from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2

# Fox et al. (1999): a robot is found again when its pose is within 45 cm of the truth for 10 s.
RIGHT = PoseError(0.45, math.radians(10.0))
HELD_S = 10.0

# A smaller displacement is no kidnap.
NEAR = PoseError(0.5, math.radians(20.0))

DETECTED_WITHIN_S = 3.0
SLOW_S = 3.0

SLIP = "slip"
"""The disturbance that is no kidnap, whatever its size."""

_EPS_S = 1e-6  # stamps are sums of floats


@dataclass(frozen=True, slots=True)
class Instant:
    """One scan: the truth, and the answer of the localizer.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    truth : SE2 or None
        ``T_map_base``; None if it is unknown.
    T_odom_base : SE2
        Odometry at the scan.
    useful : bool
        True if the robot stands on its wheels and at least `global_localization.beams.FEWEST_HITS`
        beams hit something.
    disturbed : bool
        True during a disturbance.
    over : str or None
        The disturbance that ended just before this scan.
    signalled : bool
        True if a sensor of the base has just begun to report that the robot is lifted.
    localized : bool
        True if the localizer is in the state LOCALIZED after this scan.
    published : SE2 or None
        The published pose.
    fixes : tuple of SE2
        Poses published as found, at the start or again.
    places : tuple of Hypothesis or None
        The places that were reported for this scan.
    said : tuple of str
        Status messages.
    cpu_s : float
        Processor time, s.
    """

    stamp: float
    truth: SE2 | None
    T_odom_base: SE2
    useful: bool = True
    disturbed: bool = False
    over: str | None = None
    signalled: bool = False
    localized: bool = False
    published: SE2 | None = None
    fixes: tuple[SE2, ...] = ()
    places: tuple[Hypothesis, ...] | None = None
    said: tuple[str, ...] = ()
    cpu_s: float = 0.0

    @property
    def is_right(self) -> bool:
        """True if the published pose is that of the robot."""
        return self.published is not None and self.is_true(self.published)

    @property
    def is_wrong(self) -> bool:
        """True if a pose was published for a robot that was known to be elsewhere."""
        return self.truth is not None and self.published is not None and not self.is_right

    def is_true(self, pose: SE2) -> bool:
        """Return whether a pose is the true one; False if the truth is unknown."""
        return self.truth is not None and PoseError.between(pose, self.truth).is_within(RIGHT)


@dataclass(frozen=True, slots=True)
class Aftermath:
    """The time after one disturbance, or after the start.

    Parameters
    ----------
    kind : str
        The disturbance, or ``start``.
    stamp : float
        Time of the first useful scan, s.
    is_kidnap : bool
        True if the robot moved farther than `NEAR` from where odometry puts it, and did not slip.
    signalled : bool
        True if a sensor of the base reported it.
    known_before : bool
        True if the published pose was right just before.
    left_after_s : float or None
        Useful time until the old pose was given up, s; None if never.
    recovered_after_s : float or None
        Time from `stamp` to the beginning of `HELD_S` seconds of right poses, s; None if there are
        none before the next disturbance.
    """

    kind: str
    stamp: float
    is_kidnap: bool
    signalled: bool
    known_before: bool
    left_after_s: float | None
    recovered_after_s: float | None

    @property
    def is_detected(self) -> bool:
        """True if the old pose was given up within `DETECTED_WITHIN_S` of useful scans."""
        return self.left_after_s is not None and self.left_after_s <= DETECTED_WITHIN_S + _EPS_S


@dataclass(frozen=True, slots=True)
class Trial:
    """The judgement of one scenario; every index is that of an instant.

    Calm lasts from the end of the `HELD_S` that prove a recovery to the next disturbance.

    Parameters
    ----------
    start : Aftermath or None
        After the start; None if no scan was useful.
    aftermaths : tuple of Aftermath
        After every disturbance that is followed by useful scans.
    first_fix : bool or None
        Whether the first pose published as found, before any disturbance, was right; None without
        one.
    wrong_fixes : tuple of int
        Wrong poses published as found.
    alarms : tuple of int
        False alarms: in calm, a pose that was not wrong was given up or replaced.
    strays : tuple of int
        In calm, the published pose became wrong.
    calm_s, duration_s : float
        Length of the calm, and of the whole scenario, s.
    """

    start: Aftermath | None
    aftermaths: tuple[Aftermath, ...]
    first_fix: bool | None
    wrong_fixes: tuple[int, ...]
    alarms: tuple[int, ...]
    strays: tuple[int, ...]
    calm_s: float
    duration_s: float


def judge_trial(instants: Sequence[Instant]) -> Trial:
    """Judge a localizer by all scans of a scenario, at least one, in the order of their stamps."""
    episodes = _episodes(instants)
    calm_s = 0.0
    alarms: list[int] = []
    strays: list[int] = []
    judged: list[Aftermath | None] = []
    for (_, over), (end, _) in pairwise([(0, 0), *episodes, (len(instants), len(instants))]):
        first = next((i for i in range(over, end) if instants[i].useful), None)
        if first is None:
            judged.append(None)
            continue
        found = _found(instants, first, end)
        judged.append(_aftermath(instants, over, first, end, found))
        if found is not None:
            proven_s = instants[found].stamp + HELD_S - _EPS_S
            calm = [i for i in range(found, end) if instants[i].stamp >= proven_s]
            calm_s += instants[calm[-1]].stamp - instants[calm[0]].stamp
            alarms += [i for i in calm[1:] if _is_alarm(instants[i - 1], instants[i])]
            strays += [i for i in calm[1:] if _is_stray(instants[i - 1], instants[i])]
    until = episodes[0][0] if episodes else len(instants)
    first_fixes = [
        instant.is_true(fix)
        for instant in instants[:until]
        if instant.truth is not None
        for fix in instant.fixes
    ]
    return Trial(
        start=judged[0],
        aftermaths=tuple(aftermath for aftermath in judged[1:] if aftermath is not None),
        first_fix=first_fixes[0] if first_fixes else None,
        wrong_fixes=tuple(
            i
            for i, instant in enumerate(instants)
            if instant.truth is not None
            for fix in instant.fixes
            if not instant.is_true(fix)
        ),
        alarms=tuple(alarms),
        strays=tuple(strays),
        calm_s=calm_s,
        duration_s=instants[-1].stamp - instants[0].stamp,
    )


def _episodes(instants: Sequence[Instant]) -> list[tuple[int, int]]:
    """Return the first instant of each disturbance and the first after it."""
    episodes = []
    begin: int | None = None
    for i, instant in enumerate(instants):
        if instant.over is not None:
            episodes.append((i if begin is None else begin, i))
            begin = None
        if instant.disturbed and begin is None:
            begin = i
    if begin is not None:  # the scenario ends while it lasts
        episodes.append((begin, len(instants)))
    return episodes


def _aftermath(
    instants: Sequence[Instant], over: int, first: int, end: int, found: int | None
) -> Aftermath:
    kind = instants[over].over or "start"
    begin = over
    while begin > 0 and instants[begin - 1].disturbed:
        begin -= 1
    before = instants[begin - 1] if begin > 0 else None
    stamp = instants[first].stamp
    return Aftermath(
        kind=kind,
        stamp=stamp,
        is_kidnap=kind != SLIP and before is not None and _is_far(before, instants[over]),
        signalled=any(instant.signalled for instant in instants[begin : over + 1]),
        known_before=before is not None and before.is_right,
        left_after_s=_left_after_s(instants, first, end),
        recovered_after_s=None if found is None else instants[found].stamp - stamp,
    )


def _is_far(before: Instant, after: Instant) -> bool:
    if before.truth is None or after.truth is None:
        return False
    moved = before.T_odom_base.inverse() @ after.T_odom_base
    return not PoseError.between(before.truth @ moved, after.truth).is_within(NEAR)


def _left_after_s(instants: Sequence[Instant], first: int, end: int) -> float | None:
    """Return the useful time until the localizer was not at the old place any more."""
    useful_s = 0.0
    for i in range(first, end):
        now = instants[i]
        if i > first and now.useful:
            useful_s += now.stamp - instants[i - 1].stamp
        if not now.localized or now.fixes or now.is_right:
            return useful_s
    return None


def _found(instants: Sequence[Instant], first: int, end: int) -> int | None:
    """Return where the first uninterrupted `HELD_S` of right poses begin."""
    since: int | None = None
    for i in range(first, end):
        if instants[i].truth is None:
            continue
        if not instants[i].is_right:
            since = None
            continue
        since = i if since is None else since
        if instants[i].stamp - instants[since].stamp >= HELD_S - _EPS_S:
            return since
    return None


def _is_alarm(before: Instant, now: Instant) -> bool:
    # A track that went astray by itself is rightly given up.
    astray = before.is_wrong or now.is_wrong
    return before.localized and not astray and (not now.localized or bool(now.fixes))


def _is_stray(before: Instant, now: Instant) -> bool:
    return before.is_right and now.is_wrong
