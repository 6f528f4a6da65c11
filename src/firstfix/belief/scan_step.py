"""What two consecutive scans say of the step of the odometry between them.

The map is not asked. Where nearly all of a scan lies on the one before after another step than that
of the odometry, wheels have slipped, or odometry does not know that the robot backs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.link import agreeing
from firstfix.belief.scan_matching import Agreement, ScanPair
from firstfix.belief.view import View
from firstfix.core.angles import FULL_TURN
from firstfix.core.se2 import SE2
from firstfix.global_localization.sensors import covered_angle

# A step of the odometry that costs less is not doubted, and one of the scans that costs more is not
# believed. All constants here were chosen on the real drives of docs/experiments.md, and on floors
# 3500 to 3531 with the odometry as it is, mirrored, or turned by 3 to 15 degrees.
_DOUBTFUL_COST, _GOOD_COST = 0.15, 0.25
# Where nothing else fixes the step, scans follow a person who walks ahead and hides so much of the
# view: another step must agree better than that of the odometry by more than this share.
_PERSON_RAD = math.radians(32.0)
# In a narrow view people may be nearly all that is seen, but they do not turn around the robot:
# there only its heading is believed. In a narrower one not even that.
_NARROW_RAD, _NARROWEST_RAD = math.radians(170.0), math.radians(90.0)

# Odometry is not contradicted by less than this: a scan of a moving robot is skewed, or late.
_SLIGHT_M, _SLIGHT_RAD = 0.04, math.radians(2.0)
# A robot that is farther from where odometry puts it has not slipped, it was carried.
_FARTHEST_M, _FARTHEST_RAD = 0.5, math.radians(25.0)
# Then nearly all beams agree in the looser sense of `link`, too.
_LEAST_AGREEING = 0.9
# After a longer step too little is seen in both scans.
_LONGEST_M, _WIDEST_RAD = 2.5, math.radians(70.0)

# Turns to begin with where matching from the odometry leads nowhere.
_TURNS = [np.array([0.0, 0.0, math.radians(turn)]) for turn in (-16.0, -8.0, 8.0, 16.0)]

# In a bare corridor, whose walls say nothing of the way along it, a step is held by less than this.
_HELD = 0.12


@dataclass(frozen=True, slots=True)
class Step:
    """What the scans say of a step.

    Parameters
    ----------
    by_scans : SE2 or None
        The step of the base after which the scans agree, if they contradict the odometry.
    is_confirmed : bool
        True if the scans agree after the step, that of the odometry or of the scans, and walls in
        all directions would show another one.
    """

    by_scans: SE2 | None
    is_confirmed: bool


_NOTHING_KNOWN = Step(None, is_confirmed=False)


def judge_step(before: View, now: View) -> Step:
    """Ask two views whether the robot has moved as odometry says.

    Parameters
    ----------
    before, now : View
        In the order of time.

    Returns
    -------
    Step
        Nothing is confirmed or contradicted by a view of less than 90°, or after a long step.
    """
    by_odometry = before.T_odom_base.inverse() @ now.T_odom_base
    is_long = math.hypot(by_odometry.x, by_odometry.y) > _LONGEST_M
    view_rad = min(FULL_TURN, sum(covered_angle(scan) for scan in now.scans))
    if is_long or abs(by_odometry.yaw) > _WIDEST_RAD or view_rad < _NARROWEST_RAD:
        return _NOTHING_KNOWN
    pair, given = ScanPair(before.scans, now.scans), by_odometry.as_array()
    agreement = pair.agreement(given)
    least_gain = _PERSON_RAD / view_rad
    if agreement.cost > max(_DOUBTFUL_COST, least_gain):
        found, better = _another(given, pair, view_rad)
        is_better = better.cost <= min(_GOOD_COST, agreement.cost - least_gain)
        by_scans = SE2.from_array(found)
        if is_better and _differ(by_odometry, by_scans) and _goes_on(before, now, by_scans):
            return Step(by_scans, is_confirmed=_is_held(better))
    return Step(None, is_confirmed=agreement.cost <= _GOOD_COST and _is_held(agreement))


def _another(
    given: NDArray[np.float64], pair: ScanPair, view_rad: float
) -> tuple[NDArray[np.float64], Agreement]:
    """Return the step by which the scans agree; as odometry says what they do not contradict."""
    found, better = pair.match([given])
    if not better.cost <= _GOOD_COST:
        found, better = pair.match(given + turn for turn in _TURNS)
    kept = found.copy()
    if view_rad < _NARROW_RAD:
        kept[:2] = given[:2]
        return kept, pair.agreement(kept)
    held, along = better.weakest
    kept[:2] += along * (along @ (given - found)[:2])
    agreement = pair.agreement(kept)
    is_open = held < _HELD or agreement.cost < better.cost + _PERSON_RAD / view_rad
    return (kept, agreement) if is_open else (found, better)


def _is_held(agreement: Agreement) -> bool:
    return agreement.weakest[0] >= _HELD


def _goes_on(before: View, now: View, by_scans: SE2) -> bool:
    """Tell whether one scan has not seen through the other; a carried robot's has."""
    return agreeing(before, now, by_scans) >= _LEAST_AGREEING


def _differ(by_odometry: SE2, by_scans: SE2) -> bool:
    """Tell whether a step is another one, and not so far off that the robot was carried."""
    apart = by_odometry.inverse() @ by_scans
    away, turned = math.hypot(apart.x, apart.y), abs(apart.yaw)
    if away > _FARTHEST_M or turned > _FARTHEST_RAD:
        return False
    return away > _SLIGHT_M or turned > _SLIGHT_RAD
