"""Answers."""

import numpy as np

from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.se2 import SE2

SEARCH = SearchReport(poses=10, searched=1.0, proven=True)


def test_the_best_hypothesis_is_the_first() -> None:
    evidence = Evidence(explained=1.0, short=0.0, through_wall=0.0, unknown=0.0, beams=3)
    first, second = (
        Hypothesis(SE2(x, 0.0, 0.0), np.eye(3), 0.1, 0.5, evidence) for x in (1.0, 2.0)
    )
    result = LocateResult(Verdict.AMBIGUOUS, "two places fit", (first, second), SEARCH, 0.01)
    assert result.best is first


def test_no_hypothesis_is_no_best() -> None:
    assert LocateResult(Verdict.NO_MATCH, "no beam hit", (), SEARCH, 0.01).best is None
