"""The law over many maps, on places that are made up."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from site_lab import ROOMS, draw

from firstfix.core.estimate import Evidence, Hypothesis, Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.verdict import EXPONENT, log_likelihoods, place_probabilities
from firstfix.site.judge import MAP_EXPONENT, are_one_place, judge_site
from firstfix.site.look import PROMISING, RECALL, Looked
from firstfix.site.places import SiteCandidates, SitePlace
from firstfix.site.query import SiteQuery
from firstfix.site.surroundings import are_alike, show_the_same, surroundings

EVIDENCE = Evidence(0.9, 0.1, 0.0, 0.0, 180)
BEAMS = 360
QUERY = SiteQuery.of(LaserScan(np.full(BEAMS, 3.0), -math.pi, 2 * math.pi / BEAMS, 0.1, 12.0))


PARTS = 12


def log_of(cost: float) -> float:
    best, wrong = log_likelihoods(np.array([cost, 2.3]), EXPONENT)
    return float(best - wrong)


def place(
    map_id: str,
    cost: float,
    x: float = 0.0,
    *,
    content: str = "",
    floor: str | None = None,
    T_site_base: SE2 | None = None,
    parts: tuple[float, ...] | None = None,
) -> SitePlace:
    hypothesis = Hypothesis(SE2(x, 0.0, 0.0), np.eye(3) * 1e-4, cost, 0.0, EVIDENCE, map_id=map_id)
    log = log_of(cost)
    return SitePlace(
        hypothesis,
        log,
        0.0,
        (log,),
        cost,
        T_site_base,
        content or map_id,
        (None, floor),
        (cost,) * PARTS if parts is None else parts,
    )


def judged(*places: SitePlace, recall: float = 1.0, parts: int = 1):
    names = tuple(dict.fromkeys(one.map_id for one in places))
    seen = (*names, *(f"not searched {i}" for i in range(PROMISING)))
    looked = [Looked(seen, np.zeros(len(seen)), recall, len(names))]
    found = []
    for i in range(parts):
        own = places[i::parts]
        total = np.logaddexp.reduce([one.log_posterior for one in own]) if own else -np.inf
        found.append(SiteCandidates(tuple(own), np.array([total]), names))
    return judge_site(QUERY, looked, found)


@pytest.mark.parametrize("costs", [[0.5], [0.5, 0.6], [1.2, 1.3, 2.0], [2.4]])
def test_a_site_of_one_map_has_nearly_the_law_of_the_map(costs: list[float]) -> None:
    result = judged(*(place("a", cost, 3.0 * i) for i, cost in enumerate(costs)))
    alone = place_probabilities(np.array(costs), EXPONENT)
    got = np.array([h.probability for h in result.hypotheses])
    # The map may be the wrong one: that counts once more.
    wrong_map = ((min(costs) + 0.2) / 2.5) ** MAP_EXPONENT
    np.testing.assert_allclose(got, alone / (1.0 + wrong_map), rtol=1e-9)


def test_another_map_is_a_rival_by_its_best_place() -> None:
    result = judged(place("a", 0.5), place("b", 0.6), place("b", 0.61, 3.0))
    odds = ((0.5 + 0.2) / (0.6 + 0.2)) ** MAP_EXPONENT
    assert result.map_probabilities["b"] == pytest.approx(
        odds * result.map_probabilities["a"], rel=1e-3
    )
    assert result.verdict is Verdict.AMBIGUOUS
    assert judged(place("a", 0.5), place("b", 0.9)).verdict is Verdict.UNIQUE


def test_no_place_is_surer_than_in_its_map_alone() -> None:
    places = [place("a", 0.5), place("a", 0.62, 3.0), place("b", 2.0)]
    alone = place_probabilities(np.array([0.5, 0.62]), EXPONENT)[0]
    assert judged(*places).hypotheses[0].probability <= alone


def test_parts_and_order_do_not_matter() -> None:
    places = [
        place(m, c, x) for m, c, x in (("a", 0.5, 0), ("b", 0.7, 0), ("a", 0.8, 3), ("c", 2.0, 0))
    ]
    whole = judged(*places).to_dict()
    for parts in (2, 3, 4, 6):
        spread = judged(*places[::-1], parts=parts).to_dict()
        spread["searched"] = whole["searched"]
        assert spread == whole


def test_what_the_first_look_may_have_missed_is_elsewhere() -> None:
    whole, cut = judged(place("a", 0.3)), judged(place("a", 0.3), recall=0.9)
    assert cut.hypotheses[0].probability == pytest.approx(0.9 * whole.hypotheses[0].probability)
    assert (whole.verdict, cut.verdict) == (Verdict.UNIQUE, Verdict.AMBIGUOUS)
    assert cut.elsewhere > 0.1


def test_two_views_of_a_site_with_many_maps_can_decide() -> None:
    # The recall of one look is below what several views need to be sure.
    seen = tuple(f"map {i}" for i in range(PROMISING + 1))
    ranges = QUERY.scans[0].ranges
    scans = [LaserScan(ranges, -math.pi, 2 * math.pi / BEAMS, 0.1, 12.0, stamp=t) for t in (0, 1)]
    query = SiteQuery.of(scans, [SE2(0, 0, 0), SE2(0.5, 0, 0)])
    sure = replace(place(seen[0], 0.3), steps=(log_of(0.3), 2.0 * log_of(0.3)))
    looked = Looked(seen, np.zeros(len(seen)), RECALL, PROMISING)
    found = SiteCandidates((sure,), np.array(sure.steps), seen[:PROMISING])
    result = judge_site(query, [looked], [found])
    assert result.verdict is Verdict.UNIQUE, result.reason
    assert 0.0 < result.elsewhere < 1.0 - RECALL
    one = judge_site(QUERY, [looked], [replace(found, places=(place(seen[0], 0.3),))])
    assert one.elsewhere >= 1.0 - RECALL


def test_places_are_one_where_maps_are_copies_or_overlap() -> None:
    a = place("a", 0.5, content="x")
    assert are_one_place(a, place("b", 0.5, 0.1, content="x"))
    assert not are_one_place(a, place("b", 0.5, 3.0, content="x"))
    assert not are_one_place(a, place("b", 0.5, 0.1))
    assert not are_one_place(a, place("a", 0.5, 0.1, content="x"))  # of one map
    low, high = (place(n, 0.5, content="x", floor=n) for n in "ab")
    assert not are_one_place(low, high)
    here, there = SE2(5.0, 0.0, 0.0), SE2(9.0, 0.0, 0.0)
    known = place("c", 0.5, 7.0, T_site_base=here)
    assert are_one_place(known, place("d", 0.5, T_site_base=here))
    assert not are_one_place(known, place("d", 0.5, 7.0, content="c", T_site_base=there))


def test_surroundings_tell_an_edited_map_from_another_floor() -> None:
    pose, moved = SE2(3.0, 2.0, 0.4), SE2(10.0, -3.0, 2.0)
    plan = ROOMS["ground"]
    ground = surroundings(MapFields(draw(plan)), pose)
    # The same map, drawn in another frame: what counts is what the robot has around it.
    other_frame = draw(plan, frame=moved)
    same = surroundings(MapFields(other_frame), moved @ pose)
    edited = surroundings(MapFields(draw([*plan, (2.0, 5.8, 2.3, 6.0)])), pose)
    first = surroundings(MapFields(draw(ROOMS["first"])), pose)
    assert show_the_same(ground, same)
    assert show_the_same(ground, edited)
    assert are_alike(ground, first), "the outer walls are the same"
    turned = surroundings(MapFields(draw(plan)), SE2(3.0, 2.0, 1.2))
    assert not are_alike(ground, turned)
    assert not show_the_same(ground, first)
    assert not show_the_same(ground, np.zeros_like(ground))


def test_a_place_ahead_by_one_thing_only_is_not_unique() -> None:
    rival = place("b", 1.0)
    ahead_everywhere = place("a", 0.4)
    assert judged(ahead_everywhere, rival).verdict is Verdict.UNIQUE
    by_one_thing = place("a", 0.4, parts=(0.0, 0.0, *(1.0,) * (PARTS - 2)))
    result = judged(by_one_thing, rival)
    assert result.verdict is Verdict.AMBIGUOUS
    assert "may have been moved" in result.reason
