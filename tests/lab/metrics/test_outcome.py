"""An answer against the truth."""

import math

import pytest

from firstfix.core.estimate import Verdict
from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2
from firstfix.lab.metrics.outcome import FOUND, NO_POSE, Answer, is_found, judge

TRUTH = SE2(1.0, 2.0, math.pi)


def test_error_goes_the_short_way_round() -> None:
    error = PoseError.between(SE2(4.0, 6.0, -math.pi + 0.1), TRUTH)
    assert error.metres == pytest.approx(5.0)
    assert error.radians == pytest.approx(0.1)


def test_both_parts_must_be_below_the_tolerance() -> None:
    assert PoseError(0.499, math.radians(9.9)).is_within(FOUND)
    for error in (PoseError(0.5, 0.0), PoseError(0.0, math.radians(10.0)), NO_POSE):
        assert not error.is_within(FOUND)


def test_a_pose_is_found_where_the_truth_is_and_is_known() -> None:
    assert is_found(TRUTH @ SE2(0.4, 0.0, 0.1), TRUTH)
    assert not is_found(TRUTH @ SE2(0.6, 0.0, 0.0), TRUTH)
    assert not is_found(TRUTH, None)


def test_rank_is_that_of_the_first_right_hypothesis(answer) -> None:
    far, turned, right = SE2(9.0, 9.0, 0.0), SE2(1.0, 2.0, 0.0), SE2(1.1, 2.0, math.pi)
    outcome = judge(
        Answer.of(answer(far, turned, right, TRUTH)), TRUTH, index=7, cpu_s=0.1, wall_s=0.2
    )
    assert outcome.rank == 3
    assert not outcome.is_found
    assert (outcome.index, outcome.cpu_s, outcome.wall_s) == (7, 0.1, 0.2)


def test_the_best_counts_whatever_the_verdict(answer) -> None:
    for verdict in Verdict:
        outcome = judge(
            Answer.of(answer(TRUTH, verdict=verdict)), TRUTH, index=0, cpu_s=0.0, wall_s=0.0
        )
        assert outcome.is_found
        assert outcome.verdict is verdict


def test_no_hypothesis_is_no_hit(answer) -> None:
    outcome = judge(
        Answer.of(answer(verdict=Verdict.NO_MATCH)), TRUTH, index=0, cpu_s=0.0, wall_s=0.0
    )
    assert outcome.error is NO_POSE
    assert outcome.rank is None
