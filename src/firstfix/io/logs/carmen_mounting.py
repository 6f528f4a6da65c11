"""Where on the robot the laser of a CARMEN log sits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from firstfix.core.se2 import SE2
from firstfix.io.logs.carmen_lines import ScanLine
from firstfix.io.ros_messages.poses import alike

# Poses in logs are rounded; a SLAM correction soon exceeds this.
SAME_M = 0.01
SAME_RAD = math.radians(0.5)


def mounted_at(
    kind: str, scans: Sequence[ScanLine], params: Mapping[str, float]
) -> tuple[SE2, tuple[str, ...]]:
    """Find the place of the laser: offsets in PARAM lines, else laser pose minus robot pose.

    The poses of a line tell it only while their difference stays the same: in logs that went
    through SLAM the laser pose is a corrected one. A rear laser looks backwards.

    Parameters
    ----------
    kind : str
        Kind of scan line.
    scans : sequence of ScanLine
        At least one, the more the better.
    params : mapping of str to float
        PARAM lines of the log; offsets in m and rad.

    Returns
    -------
    T_base_laser : SE2
        The place.
    notes : tuple of str
        What had to be assumed.
    """
    side = "rear" if kind == "RLASER" else "front"
    name = f"robot_{side}laser"
    named = [params.get(f"{name}_{what}", 0.0) for what in _OFFSETS]
    default = SE2(named[0], named[1], named[2] + (math.pi if side == "rear" else 0.0))
    if any(named):
        return default, ()
    seen = scans[0].robot_pose.inverse() @ scans[0].laser_pose
    steady = all(_same(scan.robot_pose.inverse() @ scan.laser_pose, seen) for scan in scans)
    if steady and not _same(seen, SE2.identity()):
        return seen, ()
    if steady or f"{name}_offset" in params:
        return default, ()
    note = (
        "the log does not say where the laser sits (its laser poses are corrected ones): "
        "the poses found are those of the laser"
    )
    return default, (note,)


_OFFSETS = ("offset", "side_offset", "angular_offset")


def _same(a: SE2, b: SE2) -> bool:
    return alike(a, b, distance=SAME_M, angle=SAME_RAD)
