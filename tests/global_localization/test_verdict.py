"""Costs become probabilities, and probabilities a verdict."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firstfix.core.estimate import Evidence, Verdict
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.verdict import (
    EXPONENT,
    count_rivals,
    exponent_of,
    judge,
    nothing_to_match,
    place_probabilities,
)

costs = arrays(np.float64, st.integers(1, 30), elements=st.floats(0.0, 8.0)).map(np.sort)
GOOD = Evidence(explained=0.9, short=0.08, through_wall=0.02, unknown=0.0, beams=180)
SHORT = Evidence(explained=0.3, short=0.6, through_wall=0.1, unknown=0.0, beams=180)
THROUGH = Evidence(explained=0.3, short=0.1, through_wall=0.6, unknown=0.0, beams=180)


@given(costs)
def test_probabilities_are_shares_that_leave_room_for_another_place(scores):
    p = place_probabilities(scores, EXPONENT)
    assert p.shape == scores.shape
    assert ((p >= 0.0) & (p <= 1.0)).all()
    assert p.sum() <= 1.0 + 1e-12


@given(costs)
def test_a_lower_cost_is_more_likely_and_an_equal_one_equally(scores):
    p = place_probabilities(scores, EXPONENT)
    assert (np.diff(p) <= 0.0).all()
    same = np.diff(scores) == 0.0
    assert (np.diff(p)[same] == 0.0).all()


@given(costs, st.permutations(range(30)))
def test_the_order_of_places_does_not_matter(scores, order):
    order = [i for i in order if i < len(scores)]
    np.testing.assert_allclose(
        place_probabilities(scores[order], EXPONENT),
        place_probabilities(scores, EXPONENT)[order],
        rtol=1e-9,
    )


@given(costs, st.floats(0.0, 8.0))
def test_another_place_takes_its_share_from_all_alike(scores, cost):
    """The ratio of two places does not depend on what else is listed."""
    before = place_probabilities(scores, EXPONENT)
    after = place_probabilities(np.append(scores, cost), EXPONENT)[:-1]
    assert (after <= before + 1e-12).all()
    likely = before > 1e-200
    ratio = after[likely] / before[likely]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)


@given(costs, st.integers(0, 29), st.floats(0.01, 5.0))
def test_a_place_that_fits_worse_becomes_less_likely(scores, i, more):
    i %= len(scores)
    worse = scores.copy()
    worse[i] += more
    assert place_probabilities(worse, EXPONENT)[i] <= place_probabilities(scores, EXPONENT)[i]


@pytest.mark.parametrize("n", [2, 3, 8])
def test_n_equal_places_share_alike(n):
    p = place_probabilities(np.full(n, 0.2), EXPONENT)
    assert (p == p[0]).all()
    assert 0.9 / n < p[0] <= 1.0 / n


def test_one_clear_place_is_nearly_certain_and_a_bad_one_is_nearly_nowhere():
    assert place_probabilities(np.array([0.1, 1.5]), EXPONENT)[0] > 0.95
    assert place_probabilities(np.array([4.0, 4.0]), EXPONENT).sum() < 0.05


def judged(p, evidence=GOOD, limit=0.8):
    return judge(np.array(p), evidence, limit)


def test_unique_from_the_limit_on():
    assert judged([0.8, 0.1])[0] is Verdict.UNIQUE
    assert judged([0.7999, 0.1])[0] is Verdict.AMBIGUOUS
    assert judged([0.7999, 0.1], limit=0.7)[0] is Verdict.UNIQUE


def test_ambiguous_counts_the_places_that_fit_about_as_well():
    verdict, reason = judged([0.4, 0.35, 0.2, 0.001])
    assert verdict is Verdict.AMBIGUOUS
    assert reason.startswith("3 places")


def test_ambiguous_alone():
    verdict, reason = judged([0.6, 0.001])
    assert verdict is Verdict.AMBIGUOUS
    assert "places" not in reason


@pytest.mark.parametrize(
    ("evidence", "words"), [(THROUGH, "see through its walls"), (SHORT, "end elsewhere")]
)
def test_the_reason_of_no_match_is_the_evidence_against_the_best_place(evidence, words):
    verdict, reason = judged([0.2, 0.1], evidence)
    assert verdict is Verdict.NO_MATCH
    assert words in reason
    assert "30%" in reason


@given(
    arrays(np.float64, st.integers(1, 20), elements=st.floats(0.0, 1.0)),
    st.floats(0.0, 1.0),
    st.sampled_from([GOOD, SHORT, THROUGH]),
)
def test_every_result_is_judged_in_words(shares, limit, evidence):
    p = np.sort(shares / max(1.0, shares.sum()))[::-1]
    verdict, reason = judge(p, evidence, limit)
    assert (verdict is Verdict.UNIQUE) == (p[0] >= limit)
    assert reason


def some_beams(n: int, turns: float = 1.0) -> Beams:
    return Beams(np.linspace(0.0, 6.0, n), np.full(n, 2.0), np.full(n, True), turns=turns)


def test_fewer_beams_are_less_sure():
    scores = np.array([0.2, 0.4, 0.6])
    sure = [place_probabilities(scores, exponent_of(some_beams(n)))[0] for n in (8, 10, 20, 30)]
    assert sure == sorted(sure)
    assert sure[0] < 0.9 < sure[-1]
    assert exponent_of(some_beams(30)) == exponent_of(some_beams(2000)) == EXPONENT


def test_sensors_that_see_the_same_things_are_witnesses_but_not_independent_ones():
    one, two = exponent_of(some_beams(60)), exponent_of(some_beams(120, turns=2.0))
    assert one < two < 2.0 * one
    assert exponent_of(some_beams(60, turns=0.5)) == one  # it is less, but never counted as less


@given(st.integers(0, 30), st.integers(0, 7), st.integers(1, 8))
def test_a_scan_with_too_few_hits_is_answered_with_their_number(n, hits, needed):
    result = nothing_to_match(n + 1, hits, needed, 0.25)
    assert result.verdict is Verdict.NO_MATCH
    assert f"only {hits} of {n + 1} beams" in result.reason
    assert f"{needed} are needed" in result.reason
    assert result.hypotheses == ()
    assert result.best is None
    assert not result.search.proven
    assert result.elapsed_s == 0.25


@pytest.mark.parametrize(
    ("probabilities", "rivals"),
    [
        ([1.0], 1),
        ([0.93, 0.06, *[0.001] * 8], 1),  # ten are listed
        ([0.6, 0.3, 0.07, 0.03], 3),
        ([0.25] * 4, 4),
        ([0.01, 0.9], 1),
    ],
)
def test_places_fit_about_as_well_from_a_tenth_of_the_best(probabilities, rivals):
    assert count_rivals(np.array(probabilities)) == rivals
    _, reason = judge(np.sort(probabilities)[::-1], GOOD, 1.1)
    assert (f"{rivals} places fit" in reason) is (rivals > 1)
