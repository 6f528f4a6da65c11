"""From outcomes to figures, counted by hand."""

import math
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.estimate import Verdict
from firstfix.core.pose_error import PoseError
from firstfix.lab.metrics.metrics import COUNTS, Summary, summarize, total
from firstfix.lab.metrics.outcome import NO_POSE, Outcome


def outcome(
    metres: float, degrees: float, rank: int | None, verdict: Verdict = Verdict.UNIQUE
) -> Outcome:
    error = PoseError(metres, math.radians(degrees))
    return Outcome(0, verdict, error, rank, cpu_s=metres, wall_s=2 * metres, probability=0.5)


FIVE = [
    outcome(0.1, 1.0, 1),
    outcome(0.3, 2.0, 1),
    outcome(0.1, 5.0, 1, Verdict.AMBIGUOUS),
    outcome(7.0, 90.0, 4),
    Outcome(0, Verdict.NO_MATCH, NO_POSE, None, cpu_s=0.0, wall_s=0.0, probability=0.0),
]


def test_five_scans_by_hand() -> None:
    s = summarize(FIVE)
    assert s.n == 5
    assert (s.success, s.success_02) == (3 / 5, 1 / 5)
    assert (s.recall_1, s.recall_10) == (3 / 5, 4 / 5)
    assert (s.unique, s.unique_right, s.wrong_unique, s.no_match) == (3 / 5, 2 / 5, 1, 1 / 5)
    assert s.median_m == pytest.approx(0.1)
    assert s.median_deg == pytest.approx(2.0)
    assert s.p95_m == pytest.approx(0.28)
    assert (s.cpu_s, s.wall_s) == (0.1, 0.2)


def test_recall_ends_at_the_tenth() -> None:
    assert summarize([outcome(9.0, 0.0, 10), outcome(9.0, 0.0, 11)]).recall_10 == 0.5


def test_what_nothing_is_known_of_is_none() -> None:
    lost = summarize([FIVE[-1]])
    assert lost.success == 0.0
    assert lost.median_m is None
    nothing = summarize([])
    assert nothing.n == nothing.wrong_unique == 0
    assert nothing.success is None
    assert nothing.cpu_s is None


def test_total_sums_counts_and_means_the_rest_over_cases() -> None:
    both = total([summarize(FIVE), summarize(FIVE[:1]), summarize(FIVE[-1:])])
    assert (both.n, both.wrong_unique) == (7, 1)
    assert both.success == pytest.approx((3 / 5 + 1 + 0) / 3)
    assert both.median_m == pytest.approx(0.1)  # the third case has no hit


@given(
    st.lists(
        st.builds(
            outcome,
            st.floats(0.0, 50.0),
            st.floats(0.0, 180.0),
            st.none() | st.integers(1, 20),
            st.sampled_from(Verdict),
        ),
        min_size=1,
    )
)
def test_laws_of_any_outcomes(outcomes: list[Outcome]) -> None:
    s = summarize(outcomes)
    assert s.success_02 is not None
    assert s.success is not None
    assert s.unique is not None
    assert s.unique_right is not None
    assert 0.0 <= s.success_02 <= s.success <= 1.0
    assert s.unique_right <= min(s.unique, s.success)
    assert s.wrong_unique == round((s.unique - s.unique_right) * s.n)
    assert total([s]) == s


def test_every_count_is_a_figure() -> None:
    assert {f.name for f in fields(Summary)} >= COUNTS
