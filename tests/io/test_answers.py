"""An answer as a document for programs."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.se2 import SE2
from firstfix.io.answers import answer_document, finite

PLACE = Hypothesis(
    SE2(1.0, 2.0, 0.5),
    np.diag([0.01, np.nan, np.inf]),
    score=0.3,
    probability=0.9,
    evidence=Evidence(1.0, 0.0, 0.0, 0.0, 180),
)


def result(*places: Hypothesis) -> LocateResult:
    verdict = Verdict.UNIQUE if places else Verdict.NO_MATCH
    return LocateResult(verdict, "because", places, SearchReport(10, 1.0, proven=True), 0.02)


def test_the_best_place_is_told_with_its_error():
    told = answer_document(3, result(PLACE), SE2(1.0, 2.3, 0.5 + math.pi / 2))
    assert (told["index"], told["verdict"], told["pose"]) == (3, "UNIQUE", [1.0, 2.0, 0.5])
    assert told["error"] == {"m": pytest.approx(0.3), "deg": pytest.approx(90.0)}
    assert told["hypotheses"][0]["evidence"]["beams"] == 180
    assert told["search"] == {"poses": 10, "searched": 1.0, "proven": True}


def test_what_json_cannot_say_is_null():
    told = answer_document(0, result(PLACE), None)
    json.dumps(told, allow_nan=False)
    assert told["covariance"] == [[0.01, 0.0, 0.0], [0.0, None, 0.0], [0.0, 0.0, None]]
    assert finite({"a": [math.nan, {"b": -math.inf}], "c": "nan"}) == {
        "a": [None, {"b": None}],
        "c": "nan",
    }


def test_no_place_is_null_too():
    told = answer_document(0, result(), SE2.identity())
    assert (told["pose"], told["covariance"], told["error"]) == (None, None, None)
    assert told["hypotheses"] == []
