"""Several scans in one call: of a robot that stood, turned or drove a little."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

from firstfix.belief.at_rest import longest_consistent
from firstfix.belief.belief import REST_M, REST_RAD, Belief, begin, brings_news, update
from firstfix.belief.config import BeliefConfig
from firstfix.belief.view import View
from firstfix.core.errors import InputError
from firstfix.core.estimate import LocateResult
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.prior import Prior
from firstfix.global_localization.sensors import at_one_time, instants

# No robot in a building is faster; and a way this long between two scans hides what lies between.
FASTEST_M_S = 5.0
LONGEST_STEP_M = 5.0


def locate_several(
    scans: Sequence[LaserScan],
    T_odom_base: Sequence[SE2],
    fields: MapFields,
    prior: Prior | None = None,
    config: BeliefConfig | None = None,
) -> LocateResult:
    """Find where in the map the last of several scans was taken.

    Parameters
    ----------
    scans : sequence of LaserScan
        Of one robot, oldest first; at least one.
    T_odom_base : sequence of SE2
        Odometry at each scan.
    fields : MapFields
        The prepared map.
    prior : Prior, optional
        Of the pose at the first scan.
    config : BeliefConfig, optional
        Settings.

    Returns
    -------
    LocateResult
        Verdict and places for ``T_map_base`` at the last scan, judged by all scans.

    Raises
    ------
    InputError
        If there is no scan, the lengths differ, the scans are out of order or the odometry jumps.
    """
    started = time.perf_counter()
    check_sequence(scans, T_odom_base)
    belief = begin(fields, prior, config)
    for view in distinct_views(scans, T_odom_base):
        if brings_news(belief, view.T_odom_base) or view.T_odom_base is T_odom_base[-1]:
            belief = update(belief, view)
    seen = belief.window[-1].scans if belief.window else tuple(scans[-1:])
    return replace(as_result(belief, time.perf_counter() - started), scans=seen)


def as_result(belief: Belief, elapsed_s: float) -> LocateResult:
    """Return a belief in the form of the static stage's answer."""
    return LocateResult(
        verdict=belief.verdict,
        reason=belief.reason,
        hypotheses=belief.places,
        search=belief.search,
        elapsed_s=elapsed_s,
    )


def distinct_views(scans: Sequence[LaserScan], T_odom_base: Sequence[SE2]) -> list[View]:
    """Make a view of each instant, and combine views that follow each other at rest.

    Parameters
    ----------
    scans : sequence of LaserScan
        Oldest first; of one sensor or several.
    T_odom_base : sequence of SE2
        Odometry at each scan.

    Returns
    -------
    list of View
        With the odometry of the last scan at each place.
    """
    groups: list[list[View]] = []
    for index in instants(scans):
        poses = [T_odom_base[i] for i in index]
        view = View(at_one_time([scans[i] for i in index], poses), poses[-1])
        if groups and _rests(groups[-1][0], view) and _alike(groups[-1][-1], view):
            groups[-1].append(view)
        else:
            groups.append([view])
    return [
        View(
            tuple(map(longest_consistent, zip(*(view.scans for view in group), strict=True))),
            group[-1].T_odom_base,
        )
        for group in groups
    ]


def check_sequence(scans: Sequence[LaserScan], T_odom_base: Sequence[SE2]) -> None:
    """Raise InputError if several scans and their odometry cannot belong together."""
    if len(scans) == 0 or len(scans) != len(T_odom_base):
        raise InputError(
            expected="at least one scan, and odometry at each",
            received=f"{len(scans)} scans and {len(T_odom_base)} poses",
            remedy="give T_odom_base at the timestamp of every scan",
        )
    for i in range(1, len(scans)):
        passed = scans[i].stamp - scans[i - 1].stamp
        moved = T_odom_base[i].distance_to(T_odom_base[i - 1])
        if passed < 0.0:
            raise InputError(
                expected="scans in order of time",
                received=f"scan {i} that is {-passed:.2f} s older than the one before",
                remedy="sort scans and odometry by timestamp",
            )
        limit = LONGEST_STEP_M if passed == 0.0 else min(LONGEST_STEP_M, 0.5 + FASTEST_M_S * passed)
        if moved > limit:
            raise InputError(
                expected=f"odometry that moves at most {limit:.1f} m from scan to scan",
                received=f"a jump of {moved:.1f} m before scan {i}",
                remedy="start anew where the odometry was reset, or give more scans on the way",
            )


def _rests(start: View, end: View) -> bool:
    step = start.T_odom_base.inverse() @ end.T_odom_base
    return math.hypot(step.x, step.y) <= REST_M and abs(step.yaw) <= REST_RAD


def _alike(a: View, b: View) -> bool:
    return [_beams_of(scan) for scan in a.scans] == [_beams_of(scan) for scan in b.scans]


def _beams_of(scan: LaserScan) -> tuple[float, ...]:
    return len(scan), scan.angle_min, scan.angle_increment
