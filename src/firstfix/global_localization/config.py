"""Settings of global localization."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firstfix.core.settings import check_settings, setting

# The largest search grid: `search_grid.MAX_POSITIONS` times `range_table.DIRECTIONS`. Importing
# these here would load numba with every command line.
MAX_POSES = 102_400_000


class Method(Enum):
    """How the map is searched.

    Examples
    --------
    >>> ff.ScanMatcher(grid, method="paper").method
    <Method.PAPER: 'paper'>
    """

    FAST = "fast"
    PAPER = "paper"
    PAPER_BASIC = "paper-basic"


@dataclass(frozen=True, slots=True)
class LocateConfig:
    """Settings of the default method; the metadata of each field has its description and range.

    Every default holds for all maps and sensors. ``max_poses`` limits the search by work, not by
    time: the same scan gets the same answer on any machine and under any load. The default is the
    largest search grid, so nothing is left out.

    Raises
    ------
    InputError
        If a setting has the wrong type or is out of its range.

    Examples
    --------
    >>> config = ff.LocateConfig(unique_probability=0.99)
    >>> matcher = ff.ScanMatcher(grid, config=config)
    """

    max_poses: int = setting(MAX_POSES, "most poses that the search scores; fewer: never UNIQUE", 1)
    shortlist: int = setting(150, "places of the search that are refined", 1, 100_000)
    hypotheses: int = setting(24, "most places in a result", 2, 1_000)
    unique_probability: float = setting(
        0.95, "least probability of the best place for the verdict UNIQUE", 0.0, 1.0
    )

    def __post_init__(self) -> None:
        check_settings(self)
