"""Whether a saved pose is still valid after a restart."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import SavedPose

MAX_JUMP_M = 0.5
"""Odometry that moved farther than this since saving may have been reset."""

# Difference between the clocks of one robot, s; more means that the clock was set back.
_CLOCK_TOLERANCE_S = 1.0
# Odometry this close to zero, m, has just started. The heading does not count: some bases take it
# from a compass.
_START_M = 0.05


class RecallOutcome(Enum):
    """Validity of a saved pose."""

    MOVED = "moved along with odometry"
    UNCONFIRMED = "used as it was saved"
    REJECTED = "not used"


@dataclass(frozen=True, slots=True)
class RecalledPose:
    """A verified saved pose.

    Parameters
    ----------
    T_map_base : SE2 or None
        Expected pose now; None if rejected.
    outcome : RecallOutcome
        MOVED: odometry continued, and its increment since saving is applied. UNCONFIRMED: valid if
        the robot was not moved meanwhile; verify it with a scan before driving. REJECTED: search.
    reason : str
        A part of a sentence for people.
    """

    T_map_base: SE2 | None
    outcome: RecallOutcome
    reason: str


def recall(
    saved: SavedPose,
    *,
    now: float,
    T_odom_base: SE2 | None,
    map_key: str,
    max_age_s: float,
    max_jump_m: float = MAX_JUMP_M,
) -> RecalledPose:
    """Verify a saved pose.

    Odometry close to zero may have been restarted, as after every reboot: it neither confirms nor
    contradicts. Odometry elsewhere, within `max_jump_m` of the saved one, continued. Farther away
    it contradicts: the robot was driven, perhaps after a restart of odometry.

    Parameters
    ----------
    saved : SavedPose
        From `load_pose`.
    now : float
        Time, s, of the clock of ``saved.stamp``.
    T_odom_base : SE2 or None
        Odometry now; None if unknown.
    map_key : str
        Of the map in use.
    max_age_s : float
        Largest age, s; infinite for a robot that is never moved while it is off.
    max_jump_m : float
        Largest distance by odometry since saving, m.

    Returns
    -------
    RecalledPose
        The pose, or why there is none.
    """
    objection = _objection(saved, now, map_key, max_age_s)
    if objection is not None:
        return RecalledPose(None, RecallOutcome.REJECTED, objection)
    ago = f"saved {_duration(now - saved.stamp)} ago"
    if saved.T_odom_base is None or T_odom_base is None:
        reason = f"{ago}; without odometry a movement since then is not known"
        return RecalledPose(saved.T_map_base, RecallOutcome.UNCONFIRMED, reason)
    if T_odom_base.distance_to(SE2.identity()) <= _START_M:
        reason = f"{ago}; odometry was restarted, so a movement since then is not known"
        return RecalledPose(saved.T_map_base, RecallOutcome.UNCONFIRMED, reason)
    moved = saved.T_odom_base.distance_to(T_odom_base)
    if not moved <= max_jump_m:  # true for NaN
        reason = (
            f"the robot has moved {moved:.1f} m since by odometry, "
            f"more than {max_jump_m:g} m, unless odometry was restarted"
        )
        return RecalledPose(None, RecallOutcome.REJECTED, reason)
    reason = f"{ago}; the robot has moved {moved:.2f} m since by odometry"
    T_map_base = saved.T_map_base @ (saved.T_odom_base.inverse() @ T_odom_base)
    return RecalledPose(T_map_base, RecallOutcome.MOVED, reason)


def _objection(saved: SavedPose, now: float, map_key: str, max_age_s: float) -> str | None:
    """Return why a pose is invalid whatever odometry says, or None."""
    if saved.map_key != map_key:
        return "it is a pose in another map"
    age = now - saved.stamp
    if age < -_CLOCK_TOLERANCE_S:
        return f"saved {_duration(-age)} in the future: the clock was set back"
    if not age <= max_age_s:  # true for NaN
        return f"saved {_duration(age)} ago, longer than {_duration(max_age_s)}"
    return None


def _duration(seconds: float) -> str:
    for unit, length in (("days", 86_400.0), ("h", 3_600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{max(seconds, 0.0):.0f} s"
