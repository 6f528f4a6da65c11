"""Options of the commands that read the sensors of a log."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.core.recording import Recording

Topics = Annotated[
    list[str] | None,
    typer.Option(
        "--topic", help="Scan topic of a bag; repeat it for several sensors that decide together."
    ),
]
LaserPose = Annotated[
    str | None,
    typer.Option(
        "--laser-pose",
        metavar="X,Y,YAW[,ROLL]",
        help="Pose of the sensor on the robot (m, rad), for a bag without transforms; ROLL 3.14 "
        "is upside down.",
    ),
]
BaseFrame = Annotated[
    str | None, typer.Option("--base-frame", metavar="FRAME", help="Frame of the robot in a bag.")
]
LaserFrame = Annotated[
    str | None,
    typer.Option(
        "--laser-frame",
        metavar="FRAME",
        help="Frame of the sensor in a bag, in place of that in its messages.",
    ),
]

HeightBand = Annotated[
    str | None,
    typer.Option(
        "--height-band",
        metavar="LOW,HIGH",
        help="Heights above the base of 3D points that are used, m.",
        show_default="0.1,1.8",
    ),
]

# As of a sensor in tf: a scan that is tilted more is no cut through the walls at one height.
_MOST_TILT_RAD = math.radians(30.0)


def read_log(
    path: Path,
    topics: list[str] | None,
    laser_pose: str | None,
    base_frame: str | None,
    laser_frame: str | None,
    max_scans: int | None = None,
    height_band: str | None = None,
) -> Recording:
    """Read a recording under these options, and straighten its scans by its odometry."""
    from firstfix.core.points import DEFAULT_BAND_M
    from firstfix.core.scan import Mounting
    from firstfix.io.logs.load import load_recording

    x_y_yaw, is_upside_down = (None, False) if laser_pose is None else _parsed(laser_pose)
    recording = load_recording(
        path,
        topic=topics,
        max_scans=max_scans,
        T_base_laser=x_y_yaw,
        mounting=Mounting.UPSIDE_DOWN if is_upside_down else Mounting.UPRIGHT,
        base_frame=base_frame,
        laser_frame=laser_frame,
        height_band=DEFAULT_BAND_M if height_band is None else _band(height_band),
    )
    return recording.deskewed()


def _band(text: str) -> tuple[float, float]:
    try:
        low, high = (float(number) for number in text.split(","))
    except ValueError:
        low, high = math.nan, math.nan
    if -math.inf < low < high < math.inf:
        return low, high
    raise InputError(
        f"--height-band {text} is not a band. Write the lower and the higher height in metres, "
        "such as 0.1,1.8."
    )


def _parsed(text: str) -> tuple[tuple[float, float, float], bool]:
    """Return x (m), y (m), yaw (rad), and whether the sensor is upside down."""
    try:
        x, y, yaw, roll = (float(number) for number in f"{text},0".split(",")[:4])
        tilt = abs(math.remainder(roll, math.tau))
        is_upside_down = tilt > math.pi / 2
        level = math.pi - tilt if is_upside_down else tilt
        if text.count(",") <= 3 and level <= _MOST_TILT_RAD and math.isfinite(x + y + yaw):
            return (x, y, yaw), is_upside_down
    except ValueError:
        pass
    raise InputError(
        f"--laser-pose {text} is not a pose. Write X,Y,YAW in metres and radians, such as "
        "0.2,0,1.57, and a fourth number 3.14 if the sensor is upside down."
    )
