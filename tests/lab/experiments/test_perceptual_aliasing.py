"""Perceptual aliasing, from verdicts and the distances between places."""

from typing import Any

import pytest

from firstfix.core.estimate import LocateResult, SearchReport, Verdict
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.perceptual_aliasing import Look, Place, doubles, look_from, share

HERE, NEAR_HERE, THERE = SE2(2.0, 2.0, 1.0), SE2(2.1, 2.0, 1.1), SE2(10.0, 2.0, 1.0)


@pytest.mark.parametrize(
    ("poses", "verdict", "look", "double"),
    [
        ([NEAR_HERE], Verdict.UNIQUE, Look.FOUND, None),
        ([THERE], Verdict.UNIQUE, Look.MISTAKEN, THERE),
        ([SE2(2.0, 2.0, -2.0)], Verdict.UNIQUE, Look.MISTAKEN, SE2(2.0, 2.0, -2.0)),
        ([NEAR_HERE, THERE], Verdict.AMBIGUOUS, Look.AMBIGUOUS, THERE),
        ([THERE, NEAR_HERE], Verdict.AMBIGUOUS, Look.AMBIGUOUS, THERE),
        ([NEAR_HERE], Verdict.AMBIGUOUS, Look.FOUND, None),
        ([NEAR_HERE, THERE], Verdict.NO_MATCH, Look.LOST, THERE),
    ],
)
def test_a_place_is_compared_with_where_it_was_found(
    answer: Any, poses: list[SE2], verdict: Verdict, look: Look, double: SE2 | None
) -> None:
    place = look_from(HERE, answer(*poses, verdict=verdict))
    assert (place.pose, place.look) == (HERE, look)
    assert (None if place.double is None else place.double.pose) == double


def test_a_scan_without_a_match_is_lost() -> None:
    silent = LocateResult(Verdict.NO_MATCH, "dark", (), SearchReport(0, 0.0, proven=False), 0.0)
    assert look_from(HERE, silent).look is Look.LOST


def test_a_place_that_is_hardly_likely_is_no_double(answer: Any) -> None:
    far = [SE2(10.0 + i, 2.0, 1.0) for i in range(30)]
    assert look_from(HERE, answer(HERE, *far, verdict=Verdict.AMBIGUOUS)).double is None


def test_shares_and_pairs(answer: Any) -> None:
    places = [
        look_from(HERE, answer(HERE)),
        look_from(HERE, answer(HERE, THERE, SE2(20.0, 2.0, 1.0), verdict=Verdict.AMBIGUOUS)),
        look_from(HERE, answer(HERE, THERE, verdict=Verdict.AMBIGUOUS)),
        look_from(HERE, answer(HERE, THERE, verdict=Verdict.NO_MATCH)),
    ]
    assert [share(places, look) for look in Look] == [0.25, 0.5, 0.25, 0.0]
    pairs = doubles(places)
    assert [(pose, double.pose) for pose, double in pairs] == [(HERE, THERE)] * 2
    assert [double.probability for _, double in pairs] == pytest.approx([1 / 2, 1 / 3])


def test_no_places_have_no_shares() -> None:
    nothing: list[Place] = []
    assert share(nothing, Look.FOUND) == 0.0
    assert doubles(nothing) == []
