"""What became of a robot that was found, followed, carried away and found again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2
from firstfix.lab.metrics.outcome import is_found


@dataclass(frozen=True, slots=True)
class DemoStep:
    """One scan of the story.

    Parameters
    ----------
    stamp : float
        Time, s.
    truth : SE2
        ``T_map_base``.
    published : SE2 or None
        Where the robot was said to be; None where nothing was.
    initial : SE2 or None
        The pose at which it was found, where it was just found.
    state : str
        What the localizer was doing after the scan.
    reason : str
        Why, as it said.
    episode : int
        Which part of the story this is: a new one begins with each kidnap.
    lifted : bool
        True while somebody carries the robot.
    cpu_s : float
        Processor time that the localizer took for it, s.
    """

    stamp: float
    truth: SE2
    published: SE2 | None
    initial: SE2 | None
    state: str
    reason: str
    episode: int
    lifted: bool
    cpu_s: float

    @property
    def is_right(self) -> bool:
        """True if a pose was published, and the truth is there."""
        return self.published is not None and is_found(self.published, self.truth)


@dataclass(frozen=True, slots=True)
class Episode:
    """One part of the story: from a kidnap, or the beginning, to the next.

    Parameters
    ----------
    began_s : float
        Time from which the robot could be found: it stands on its wheels and sees, s.
    noticed_s : float or None
        Time until the old pose was given up, from then on, s; 0 if before; None if never.
    found_s : float or None
        Time until a right pose was published, from then on, s; None if never.
    found_error_m, found_error_deg : float
        Error of that pose; NaN if there was none.
    wrong_finds : int
        How often the robot was "found" where it was not.
    kept : float
        Share of the scans after it was found with a right pose, 0 to 1; NaN if there is none.
    rmse_m, rmse_deg : float
        Errors of all poses after it was found; NaN if there is none.
    """

    began_s: float
    noticed_s: float | None
    found_s: float | None
    found_error_m: float
    found_error_deg: float
    wrong_finds: int
    kept: float
    rmse_m: float
    rmse_deg: float

    @property
    def went_well(self) -> bool:
        """True if the robot was found at once at the right place and tracked to the end."""
        return self.found_s is not None and self.wrong_finds == 0 and self.kept > 0.99


def summarize_episodes(steps: Sequence[DemoStep]) -> list[Episode]:
    """Sum up each episode.

    Parameters
    ----------
    steps : sequence of DemoStep
        In the order of their stamps.

    Returns
    -------
    list of Episode
        In order.
    """
    numbers = sorted({step.episode for step in steps})
    return [_tell([step for step in steps if step.episode == number]) for number in numbers]


def _tell(steps: list[DemoStep]) -> Episode:
    standing = [step for step in steps if not step.lifted]
    seeing = standing or steps
    began = seeing[0].stamp
    given_up = [step for step in seeing if step.published is None or step.is_right]
    found = next((i for i, step in enumerate(seeing) if step.is_right), None)
    after = seeing[found:] if found is not None else []
    off = [
        PoseError.between(step.published, step.truth)
        for step in after
        if step.published is not None
    ]
    metres = np.array([error.metres for error in off])
    degrees = np.array([error.radians for error in off]) * math.degrees(1.0)
    return Episode(
        began_s=began,
        noticed_s=given_up[0].stamp - began if given_up else None,
        found_s=seeing[found].stamp - began if found is not None else None,
        found_error_m=float(metres[0]) if len(metres) else math.nan,
        found_error_deg=float(degrees[0]) if len(degrees) else math.nan,
        wrong_finds=sum(
            step.initial is not None and not is_found(step.initial, step.truth) for step in steps
        ),
        kept=sum(step.is_right for step in after) / len(after) if after else math.nan,
        rmse_m=float(np.sqrt(np.mean(np.square(metres)))) if len(metres) else math.nan,
        rmse_deg=float(np.sqrt(np.mean(np.square(degrees)))) if len(degrees) else math.nan,
    )
