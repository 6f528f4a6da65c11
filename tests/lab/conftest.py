"""A drawn hall, and answers as a test wants them."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.case import Case

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))  # live_lab

Answer = Callable[..., LocateResult]


@pytest.fixture(scope="session")
def hall() -> OccupancyGrid:
    """10 x 6 m with walls of one cell; beyond them nothing."""
    cells = np.zeros((60, 100), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return OccupancyGrid(cells, 0.1)


@pytest.fixture(scope="session")
def middle() -> SE2:
    return SE2(5.0, 3.0, 0.0)


@pytest.fixture(scope="session")
def cross() -> LaserScan:
    """What four beams measure in the middle of the hall."""
    return LaserScan(np.array([2.9, 4.9, 2.9, 4.9]), -np.pi / 2, np.pi / 2, 0.1, 10.0)


@pytest.fixture
def case(hall: OccupancyGrid, cross: LaserScan, middle: SE2) -> Case:
    truth = np.tile(middle.as_array(), (5, 1))
    truth[1] = np.nan
    return Case("hall", "here", "sim", lambda: hall, lambda: Recording((cross,) * 5, truth=truth))


@pytest.fixture
def answer() -> Answer:
    def make(*poses: SE2, verdict: Verdict = Verdict.UNIQUE) -> LocateResult:
        evidence = Evidence(explained=1.0, short=0.0, through_wall=0.0, unknown=0.0, beams=4)
        hypotheses = tuple(
            Hypothesis(pose, np.eye(3), 0.1 * i, 1.0 / len(poses), evidence)
            for i, pose in enumerate(poses)
        )
        search = SearchReport(poses=10, searched=1.0, proven=True)
        return LocateResult(verdict, "as the test wants it", hypotheses, search, 0.01)

    return make
