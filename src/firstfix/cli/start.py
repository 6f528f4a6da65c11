"""Where ``firstfix track`` begins: what a user may say, and what it means."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from firstfix.core.grid import OccupancyGrid
    from firstfix.core.recording import Recording
    from firstfix.ros.node_config import NodeConfig

TRUTH = "truth"
SEARCH = "search"
WAYS = f"X,Y,YAW (m, m, rad), {SEARCH}, {TRUTH}, or the file of a saved pose"


class Origin(Enum):
    """Whose word the start is; the values are those of the JSON."""

    GIVEN = "given"
    SAVED = "saved"
    PARAMETERS = "parameters"
    TRUTH = "truth"
    SEARCH = "search"


@dataclass(frozen=True, slots=True)
class Start:
    """Where to begin.

    Parameters
    ----------
    origin : Origin
        Whose word it is.
    T_map_base : SE2 or None
        The pose at the first scan that has odometry; None for the first true pose, or the search.
    covariance : ndarray, shape (3, 3)
        How sure that is: x (m), y (m), yaw (rad).
    note : str
        For a person.
    """

    origin: Origin
    T_map_base: SE2 | None
    covariance: NDArray[np.float64]
    note: str


def read_start(text: str | None) -> SE2 | Path | str | None:
    """Read what was said of the start, before any file is opened.

    Parameters
    ----------
    text : str or None
        ``X,Y,YAW``, ``search``, ``truth``, the name of a file, or None where nothing was said.

    Returns
    -------
    SE2, Path, str or None
        The pose, the file, `SEARCH`, `TRUTH`, or None.

    Raises
    ------
    InputError
        If it is none of these.
    """
    if text is None or text in (TRUTH, SEARCH):
        return text
    if Path(text).is_file():
        return Path(text)
    try:
        x, y, yaw = (float(number) for number in text.split(","))
        return SE2(x, y, yaw)
    except (ValueError, InputError):
        raise InputError(
            expected=f"a start as {WAYS}",
            received=f"{text!r}, which is neither three numbers nor a file",
            remedy="write it like --start 1.5,-2,0.7",
        ) from None


def choose_start(
    said: SE2 | Path | str | None, grid: OccupancyGrid, recording: Recording, config: NodeConfig
) -> Start:
    """Choose where to begin: what was said, else what the parameters say, else the truth.

    Parameters
    ----------
    said : SE2, Path, str or None
        From `read_start`.
    grid : OccupancyGrid
        The map.
    recording : Recording
        The log.
    config : NodeConfig
        set_initial_pose and initial_pose.

    Returns
    -------
    Start
        In the map.

    Raises
    ------
    InputError
        If nobody knows where to begin, a saved pose must not be used, or it is outside the map.
    """
    from firstfix.lab.experiments.drive_tracking import GIVEN_START, TRUE_START, check_start

    if said == SEARCH:
        start = Start(Origin.SEARCH, None, TRUE_START, "searching the whole map")
    elif isinstance(said, Path):
        start = _saved(said, grid, recording)
    elif isinstance(said, SE2):
        start = Start(Origin.GIVEN, said, GIVEN_START, "starting at the pose given")
    elif said is None and config.set_initial_pose:
        words = "starting at initial_pose of the parameters"
        start = Start(Origin.PARAMETERS, config.initial_pose, GIVEN_START, words)
    else:
        start = _true(recording, is_asked_for=said is not None)
    if start.T_map_base is not None:
        check_start(grid, start.T_map_base)
    return start


def _true(recording: Recording, *, is_asked_for: bool) -> Start:
    import numpy as np

    from firstfix.lab.experiments.drive_tracking import TRUE_START

    if recording.truth is None or not np.isfinite(recording.truth).all(axis=1).any():
        raise InputError(
            expected="a log that knows true poses" if is_asked_for else "a pose to start at",
            received="a log that knows none" if is_asked_for else "none, and a log without truth",
            remedy="let it be found by --start search, or give it by --start X,Y,YAW in metres and "
            "radians",
        )
    return Start(Origin.TRUTH, None, TRUE_START, "starting at the first true pose of the log")


def _saved(path: Path, grid: OccupancyGrid, recording: Recording) -> Start:
    import math

    from firstfix.io.recalled_pose import recall
    from firstfix.io.saved_pose import load_pose, map_key
    from firstfix.lab.experiments.drive import known_odometry
    from firstfix.lab.experiments.drive_tracking import TRUE_START

    saved = load_pose(path)
    index, T_odom_base = known_odometry(recording)[0]
    recalled = recall(
        saved,
        now=recording.scans[index].stamp,
        T_odom_base=T_odom_base,
        map_key=map_key(grid),
        max_age_s=math.inf,  # who names the file says that it holds
    )
    if recalled.T_map_base is None:
        raise InputError(
            expected="a saved pose that still holds at the first scan",
            received=f"{path}: {recalled.reason}",
            remedy="run `firstfix locate --json`, and give its `pose`: --start X,Y,YAW",
        )
    # The robot may have been nudged since; and a covariance of millimetres would not admit it.
    covariance = saved.covariance + TRUE_START
    words = f"starting at the pose of {path}, {recalled.outcome.value} ({recalled.reason})"
    return Start(Origin.SAVED, recalled.T_map_base, covariance, words)
