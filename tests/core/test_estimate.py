"""Results: the best place, one line for people, JSON for programs."""

import json
import math

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.se2 import SE2

SEARCH = SearchReport(poses=10, searched=1.0, proven=True)
EVIDENCE = Evidence(explained=0.9, short=0.1, through_wall=0.0, unknown=0.0, beams=180)


def place(x: float, probability: float = 0.5, sigma: float = 0.01) -> Hypothesis:
    covariance = np.diag([sigma**2, (sigma / 2) ** 2, 1e-4])
    return Hypothesis(SE2(x, 2.0, -1.55), covariance, 0.1, probability, EVIDENCE)


def result(verdict: Verdict, *places: Hypothesis) -> LocateResult:
    return LocateResult(verdict, "because", places, SEARCH, 0.02)


def test_the_best_hypothesis_is_the_first() -> None:
    first, second = place(1.0), place(2.0)
    assert result(Verdict.AMBIGUOUS, first, second).best is first


def test_without_hypotheses_there_is_no_best() -> None:
    assert result(Verdict.NO_MATCH).best is None


# --- text ---


def test_a_result_prints_as_one_line() -> None:
    text = "UNIQUE (5.90, 2.00) m -88.8° ±1.3 cm, p 1.00"
    assert str(result(Verdict.UNIQUE, place(5.9, 0.9996, 0.013))) == text
    assert repr(result(Verdict.UNIQUE, place(5.9, 0.9996, 0.013))) == f"<LocateResult {text}>"
    assert str(result(Verdict.AMBIGUOUS, place(1), place(2))).startswith("AMBIGUOUS (1.00, 2.00) m")


@pytest.mark.parametrize("places", [(), (place(1.0),)])
def test_no_match_prints_the_reason_and_no_pose(places: tuple[Hypothesis, ...]) -> None:
    assert str(result(Verdict.NO_MATCH, *places)) == "NO_MATCH: because"


def test_a_place_without_covariance_prints_without_spread() -> None:
    unknown = Hypothesis(SE2(0.0, 0.0, 0.0), np.zeros((3, 3)), 0.1, 0.25, EVIDENCE)
    assert str(unknown) == "(0.00, 0.00) m 0.0°, p 0.25"


@pytest.mark.parametrize("angle", [0.0, 0.4, math.pi / 2])
def test_sigma_is_that_of_the_least_certain_direction(angle: float) -> None:
    c, s = math.cos(angle), math.sin(angle)
    R = np.array([[c, -s], [s, c]])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = R @ np.diag([0.3**2, 0.1**2]) @ R.T
    hypothesis = Hypothesis(SE2.identity(), covariance, 0.1, 1.0, EVIDENCE)
    assert hypothesis.sigma_m == pytest.approx(0.3)


# --- JSON ---


def test_the_document_has_the_keys_of_the_page_and_the_error() -> None:
    document = result(Verdict.UNIQUE, place(1.0), place(9.0)).to_dict(
        3, SE2(1.0, 2.3, -1.55 + math.pi / 2)
    )
    assert list(document) == [
        "index",
        "verdict",
        "reason",
        "pose",
        "covariance",
        "hypotheses",
        "probability_without_prior",
        "search",
        "elapsed_s",
        "error",
    ]
    assert (document["index"], document["verdict"]) == (3, "UNIQUE")
    assert document["pose"] == pytest.approx([1.0, 2.0, -1.55])
    assert document["error"] == {"m": pytest.approx(0.3), "deg": pytest.approx(90.0)}
    assert document["covariance"] == place(1.0).covariance.tolist()
    assert [h["pose"][0] for h in document["hypotheses"]] == [1.0, 9.0]
    assert set(document["hypotheses"][0]) == {
        "pose",
        "covariance",
        "score",
        "probability",
        "evidence",
    }
    assert document["hypotheses"][0]["evidence"]["beams"] == 180
    assert document["search"] == {"poses": 10, "searched": 1.0, "proven": True}


def test_nan_and_infinity_are_null_in_the_document() -> None:
    covariance = np.diag([0.01, np.nan, np.inf])
    unknown = Hypothesis(SE2(1.0, 2.0, 0.5), covariance, math.nan, 0.9, EVIDENCE)
    document = result(Verdict.UNIQUE, unknown).to_dict()
    json.dumps(document, allow_nan=False)
    assert document["covariance"] == [[0.01, 0.0, 0.0], [0.0, None, 0.0], [0.0, 0.0, None]]
    assert document["hypotheses"][0]["score"] is None
    assert document["error"] is None


def test_without_a_place_pose_and_error_are_null() -> None:
    document = result(Verdict.NO_MATCH).to_dict(0, SE2.identity())
    assert (document["pose"], document["covariance"], document["error"]) == (None, None, None)
    assert document["hypotheses"] == []


# --- pictures ---


def test_a_result_without_map_and_scan_has_no_picture() -> None:
    bare = result(Verdict.UNIQUE, place(1.0))
    assert bare._repr_png_() is None
    assert bare._repr_html_() is None
    with pytest.raises(InputError, match=r"ScanMatcher\.locate"):
        bare.plot()
