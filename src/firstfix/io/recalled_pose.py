"""What a saved pose is still worth after a restart."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import SavedPose

MAX_JUMP_M = 0.5
"""Farther than this by odometry since saving, and odometry may as well have been reset."""

# Clocks of one robot differ by so much, s; more, and the clock was set back.
_CLOCK_TOLERANCE_S = 1.0
# Odometry this close to zero, m, has hardly begun to count. Heading says nothing: some bases take
# it from a compass.
_START_M = 0.05


class Standing(Enum):
    """What a saved pose is worth."""

    CARRIED = "carried on by odometry"
    UNCONFIRMED = "as it was saved"
    REFUSED = "not to be used"


@dataclass(frozen=True, slots=True)
class RecalledPose:
    """A judged pose.

    Parameters
    ----------
    T_map_base : SE2 or None
        Where the robot should be now; None where the saved pose must not be used.
    standing : Standing
        CARRIED: odometry ran on since, and says where to. UNCONFIRMED: right if nobody moved the
        robot meanwhile; compare with a scan before driving. REFUSED: search.
    why : str
        The reason, as part of a sentence for people.
    """

    T_map_base: SE2 | None
    standing: Standing
    why: str


def carried(saved: SavedPose, T_odom_base: SE2) -> SE2:
    """Carry a saved pose on by what odometry has counted since.

    Parameters
    ----------
    saved : SavedPose
        With odometry.
    T_odom_base : SE2
        Odometry now, of the same run.

    Returns
    -------
    SE2
        ``T_map_base`` now.

    Raises
    ------
    InputError
        If the pose was saved without odometry.
    """
    if saved.T_odom_base is None:
        raise InputError(
            expected="a pose that was saved with odometry",
            received="one without",
            remedy="use it as it was saved, or search",
        )
    return saved.T_map_base @ (saved.T_odom_base.inverse() @ T_odom_base)


def recall(
    saved: SavedPose,
    *,
    now: float,
    T_odom_base: SE2 | None,
    map_key: str,
    max_age_s: float,
    max_jump_m: float = MAX_JUMP_M,
) -> RecalledPose:
    """Judge a saved pose.

    Odometry that is close to zero may have been restarted, as it is after every reboot: it neither
    confirms nor contradicts. Odometry elsewhere, within `max_jump_m` of what was saved, ran on.
    Farther away it contradicts: the robot was driven, perhaps after odometry was restarted.

    Parameters
    ----------
    saved : SavedPose
        From `load_pose`.
    now : float
        Time, s, of the clock of ``saved.stamp``.
    T_odom_base : SE2 or None
        Odometry now; None where it is not known.
    map_key : str
        Of the map in use.
    max_age_s : float
        Age from which on somebody may have moved the robot, s; infinite for a robot that nobody
        moves.
    max_jump_m : float
        Way by odometry, m, up to which it is believed.

    Returns
    -------
    RecalledPose
        The pose, or why there is none.
    """
    why_not = _objection(saved, now, map_key, max_age_s)
    if why_not is not None:
        return RecalledPose(None, Standing.REFUSED, why_not)
    ago = f"saved {_duration(now - saved.stamp)} ago"
    if saved.T_odom_base is None or T_odom_base is None:
        why = f"{ago}; no odometry says whether the robot has moved since"
        return RecalledPose(saved.T_map_base, Standing.UNCONFIRMED, why)
    if T_odom_base.distance_to(SE2.identity()) <= _START_M:
        why = (
            f"{ago}; odometry stands at its start and cannot say whether the robot has moved since"
        )
        return RecalledPose(saved.T_map_base, Standing.UNCONFIRMED, why)
    moved = saved.T_odom_base.distance_to(T_odom_base)
    if not moved <= max_jump_m:
        why = (
            f"odometry says that the robot has moved {moved:.1f} m since, "
            f"more than {max_jump_m:g} m, unless odometry was restarted"
        )
        return RecalledPose(None, Standing.REFUSED, why)
    why = f"{ago}; odometry says that the robot has moved {moved:.2f} m since"
    return RecalledPose(carried(saved, T_odom_base), Standing.CARRIED, why)


def _objection(saved: SavedPose, now: float, map_key: str, max_age_s: float) -> str | None:
    """Say what speaks against a pose whatever odometry says."""
    if saved.map_key != map_key:
        return "the map is another one"
    age = now - saved.stamp
    if age < -_CLOCK_TOLERANCE_S:
        return f"saved {_duration(-age)} in the future: the clock was set back"
    if not age <= max_age_s:  # also where one of them is NaN
        return f"saved {_duration(age)} ago, longer than {_duration(max_age_s)}"
    return None


def _duration(seconds: float) -> str:
    """Write a time in the unit that people would use."""
    for unit, length in (("days", 86_400.0), ("h", 3_600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{max(seconds, 0.0):.0f} s"
