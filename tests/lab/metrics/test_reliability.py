"""Claims against truth, counted by hand."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from firstfix.core.estimate import Verdict
from firstfix.core.pose_error import PoseError
from firstfix.lab.experiments.locate_bench import CaseRun, WrongMapRun
from firstfix.lab.metrics.outcome import NO_POSE, Outcome
from firstfix.lab.metrics.reliability import (
    reliability_bins,
    reliability_document,
    reliability_table,
    risk_curve,
)
from firstfix.lab.reports.reliability_picture import save_reliability

CLAIMED = np.array([0.99, 0.97, 0.97, 0.5, 0.0])
RIGHT = np.array([True, True, False, True, False])
NONE = np.empty(0)

claims = hnp.arrays(np.float64, st.integers(1, 30), elements=st.floats(0.0, 1.0))


def test_a_curve_by_hand() -> None:
    curve = risk_curve(CLAIMED, RIGHT, NONE)
    assert curve.thresholds.tolist() == [0.99, 0.97, 0.5]
    assert curve.coverage.tolist() == pytest.approx([0.2, 0.6, 0.8])
    assert curve.risk.tolist() == pytest.approx([0.0, 1 / 3, 1 / 4])


def test_wrong_map_scans_are_risk_and_no_coverage() -> None:
    curve = risk_curve(CLAIMED, RIGHT, np.array([0.98, 0.1]))
    assert curve.thresholds.tolist() == [0.99, 0.98, 0.97, 0.5, 0.1]
    assert curve.coverage.tolist() == pytest.approx([0.2, 0.2, 0.6, 0.8, 0.8])
    assert curve.risk.tolist() == pytest.approx([0.0, 1 / 2, 2 / 4, 2 / 5, 3 / 6])


def test_a_curve_can_be_asked() -> None:
    curve = risk_curve(CLAIMED, RIGHT, NONE)
    assert curve.at_threshold(0.95) == pytest.approx((0.6, 1 / 3))
    assert curve.at_threshold(0.995) is None
    assert curve.coverage_at_risk(0.3) == pytest.approx(0.8)
    assert curve.coverage_at_risk(0.1) == pytest.approx(0.2)
    assert curve.risk_at_coverage(0.5) == pytest.approx(1 / 3)
    assert curve.risk_at_coverage(0.9) is None


def test_probabilities_of_0_have_an_empty_curve() -> None:
    curve = risk_curve(np.zeros(3), np.zeros(3, bool), NONE)
    assert len(curve.thresholds) == 0
    assert curve.coverage_at_risk(0.5) == 0.0


@given(claims, st.integers(0, 2**32 - 1))
def test_a_lower_threshold_covers_more_and_shares_are_shares(
    claimed: np.ndarray, seed: int
) -> None:
    right = np.random.default_rng(seed).random(len(claimed)) < 0.5
    curve = risk_curve(claimed, right, claimed[::2])
    assert (np.diff(curve.coverage) >= 0.0).all()
    assert ((curve.risk >= 0.0) & (curve.risk <= 1.0)).all()


@given(claims)
def test_every_claim_is_in_one_bin(claimed: np.ndarray) -> None:
    bins = reliability_bins(claimed, claimed > 0.5)
    assert sum(b["n"] for b in bins) == len(claimed)
    for b in bins:
        assert b["from"] - 1e-12 <= b["claimed"] <= b["to"] + 1e-12  # a mean, rounded
        assert 0.0 <= b["right_low"] <= b["right"] <= b["right_high"] <= 1.0


def runs() -> tuple[list[CaseRun], list[WrongMapRun]]:
    right = Outcome(0, Verdict.UNIQUE, PoseError(0.02, 0.001), 1, 0.03, 0.04, 0.99)
    wrong = Outcome(1, Verdict.AMBIGUOUS, PoseError(9.0, 0.001), 2, 0.03, 0.04, 0.6)
    lost = Outcome(2, Verdict.NO_MATCH, NO_POSE, None, 0.01, 0.02, 0.0)
    own = [
        CaseRun(name, name, kind, "recorded", "fast", (right, wrong, lost), 100.0, 0.5, 200.0)
        for name, kind in (("a", "real"), ("b", "real"), ("c", "sim"))
    ]
    return own, [WrongMapRun("a", "a", "real", "recorded", "c", "fast", 2, 1, (0.96, 0.2))]


def test_scans_of_a_kind_are_taken_together() -> None:
    real, sim = reliability_document(*runs())
    assert (real["kind"], real["n"], real["wrong_map_n"]) == ("real", 6, 2)
    assert (sim["kind"], sim["n"], sim["wrong_map_n"]) == ("sim", 3, 0)
    assert sim["with_wrong_map"] is None
    assert real["own"]["unique_coverage"] == pytest.approx(1 / 3)
    assert (real["own"]["unique_risk"], real["with_wrong_map"]["unique_risk"]) == (0.0, 1 / 3)
    assert [b["n"] for b in real["bins"]] == [2, 2, 2]


def test_the_table_has_wrong_map_scans_in_a_line_of_their_own(tmp_path: Path) -> None:
    entries = reliability_document(*runs())
    lines = reliability_table(entries).splitlines()
    assert len(lines) == 2 + 3
    assert "real and wrong map" in lines[3]
    assert save_reliability(entries, tmp_path / "r.png").stat().st_size > 5000
