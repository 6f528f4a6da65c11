"""What is known beforehand, in the answer to one scan."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from firstfix.belief.prior import AnyOf, Near, Region
from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.global_localization.frames import bases_in_map, to_map
from firstfix.global_localization.locate import _with_share_of_prior
from firstfix.global_localization.prior import SHARE_WITHOUT_PRIOR, PlacePrior
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.verdict import log_likelihoods, with_prior
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms

RNG = np.random.default_rng(7)
LIDAR = Lidar(beams=180, T_base_laser=SE2(0.2, 0.1, 0.5))


@pytest.fixture(scope="module")
def rooms():
    return ScanMatcher(identical_rooms(4))


@pytest.fixture(scope="module")
def seen(rooms):
    """A scan in one of four rooms that look alike, and the places of the other three."""
    free = np.argwhere(rooms.fields.grid.seen_free)
    grid, rng = rooms.fields.grid, np.random.default_rng(0)
    row, column = free[len(free) // 3]
    x, y = grid.to_map(np.array([column, row]) + 0.5)
    scan = LIDAR.scan(grid, SE2(float(x), float(y), 0.7), rng)
    result = rooms.locate(scan)
    assert result.verdict is Verdict.AMBIGUOUS
    assert result.probability_without_prior is None
    return scan, [h.pose for h in result.hypotheses[:4]]


def test_a_prior_orders_places_that_look_alike_and_leaves_them_open(rooms, seen):
    scan, places = seen
    for place in places:
        for prior in (Near(place, 1.0), Near(place @ SE2(0.6, 0.0, 0.0), 1.0), around(place)):
            result = rooms.locate(scan, prior=prior)
            assert result.verdict is Verdict.AMBIGUOUS  # it may be wrong
            assert result.best.pose.distance_to(place) < 0.1
            assert result.best.probability > 0.95
            assert result.probability_without_prior < 0.5
            assert "the prior chooses this place" in result.reason


def around(place):
    return Region([(place.x + dx, place.y + dy) for dx, dy in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def test_of_two_docks_the_heavier_is_likelier(rooms, seen):
    scan, (one, other, *_) = seen
    both = rooms.locate(scan, prior=AnyOf((Near(one, 0.5), Near(other, 0.5))))
    assert both.verdict is Verdict.AMBIGUOUS
    assert {round(h.pose.x, 1) for h in both.hypotheses[:2]} == {round(one.x, 1), round(other.x, 1)}
    heavy = rooms.locate(scan, prior=AnyOf((Near(one, 0.5), Near(other, 0.5)), (1.0, 100.0)))
    assert heavy.best.pose.distance_to(other) < 0.1
    assert heavy.best.probability > 0.95


def test_a_wrong_prior_is_overruled(draw_room, found):
    matcher, rng = ScanMatcher(draw_room(0.05)), np.random.default_rng(1)
    places = SE2(2.0, 2.5, 0.6), SE2(7.0, 5.5, -2.0)
    for truth, wrong in (places, places[::-1]):
        scan = LIDAR.scan(matcher.fields.grid, truth, rng)
        result = matcher.locate(scan, prior=Near(wrong, 0.5, 0.5))
        assert result.verdict is Verdict.UNIQUE
        assert found(result, truth, 0.05, 1.0)
        assert result.probability_without_prior > 0.99


def test_a_prior_is_a_second_witness_only_for_the_places_near_it(draw_room):
    matcher, truth = ScanMatcher(draw_room(0.05)), SE2(2.0, 2.5, 0.6)
    little = replace(LIDAR, fov=math.pi, range_max=8.0)  # one scan of it is never UNIQUE
    scan = little.scan(matcher.fields.grid, truth, np.random.default_rng(1))
    results = [matcher.locate(scan, prior=Near(p, 0.5)) for p in (truth, SE2(7.0, 5.5, -2.0))]
    assert [result.verdict for result in results] == [Verdict.UNIQUE, Verdict.AMBIGUOUS]
    assert all(result.best.pose.distance_to(truth) < 0.05 for result in results)
    assert "one scan of a sensor" in results[1].reason


def test_a_place_near_the_prior_competes_with_all_that_the_search_ranks_as_high():
    grid = OccupancyGrid(np.zeros((40, 4000), np.int8), 0.05)
    scan = replace(LIDAR, T_base_laser=SE2.identity()).scan(grid, SE2(1.0, 1.0, 0.0), RNG)
    poses = np.column_stack([np.arange(400) * 10.0, np.full(400, 20.0), np.zeros(400)])
    for index, kept in ((30, 40), (3, 13), (395, 400)):
        known = PlacePrior(Near(SE2(0.5 * index, 1.0, 0.0), 0.1), grid, scan, 12.0)
        assert (known.chosen(poses, 10) == poses[:kept]).all()
    nothing = PlacePrior(Near(SE2(0.0, 1.0, 0.0), 0.1, 0.5), grid, scan, 12.0)
    assert len(nothing.chosen(poses + np.array([0.0, 0.0, 3.0]), 10)) == 10


def test_what_is_no_prior_is_refused(rooms, seen):
    with pytest.raises(InputError, match=r"is no prior\. Pass ff\.Near"):
        rooms.locate(seen[0], prior=(1.0, 2.0, 0.0))


def test_a_prior_multiplies_likelihoods():
    scores, logs = np.array([0.1, 0.5, 1.0, 2.0]), np.array([0.0, -0.5, -3.0, -6.9])
    for exponent in (4.8, 12.0, 17.0):
        joint = log_likelihoods(with_prior(scores, logs, exponent), exponent)
        np.testing.assert_allclose(joint, log_likelihoods(scores, exponent) + logs, atol=1e-9)


def test_poses_of_the_base_are_those_of_each_pose_alone():
    grid = OccupancyGrid(np.zeros((50, 60), np.int8), 0.05, SE2(-1.0, 2.0, 0.4))
    scan = LIDAR.scan(grid, SE2(-0.5, 3.0, 0.0), np.random.default_rng(0))
    poses = np.random.default_rng(1).uniform(-3.0, 40.0, (20, 3))
    singly = [to_map(grid, scan, pose, np.eye(3))[0].as_array() for pose in poses]
    np.testing.assert_allclose(bases_in_map(grid, scan, poses), singly, atol=1e-9)


def test_a_prior_outside_the_map_is_refused(rooms, seen):
    with pytest.raises(InputError, match="a prior on the map"):
        rooms.locate(seen[0], prior=Near(SE2(1e3, 0.0, 0.0), 1.0))


def test_the_methods_of_the_paper_take_no_prior(draw_room, seen):
    matcher = ScanMatcher(draw_room(0.05), method="paper")
    with pytest.raises(InputError, match="for a prior"):
        matcher.locate(seen[0], prior=Near(SE2(2.0, 2.5, 0.0), 1.0))


def test_alternatives_need_a_weight_each():
    near = Near((1.0, 2.0, math.pi / 2), 1.0)
    assert near.pose == SE2(1.0, 2.0, math.pi / 2)
    for priors, weights in (((), ()), ((near,), (1.0, 2.0)), ((near,), (0.0,))):
        with pytest.raises(InputError, match="one weight above 0 for each"):
            AnyOf(priors, weights)


@pytest.mark.parametrize(
    ("favourite", "ratio", "words"),
    [
        (0.7, 1.0, "70% likely by the scan alone"),
        (0.6, 1.0, "the prior chooses this place"),
        (1.0, 0.09, "11 times better elsewhere"),
    ],
)
def test_a_prior_is_followed_where_the_scan_alone_finds_the_place_likely(
    rooms, seen, favourite, ratio, words
):
    scan, places = seen
    found = rooms.locate(scan, prior=Near(places[0], 1.0))
    unique = replace(found, verdict=Verdict.UNIQUE)
    result = _with_share_of_prior(unique, favourite, ratio, SHARE_WITHOUT_PRIOR)
    is_likely = favourite * ratio >= SHARE_WITHOUT_PRIOR
    assert result.verdict is (Verdict.UNIQUE if is_likely else Verdict.AMBIGUOUS)
    assert result.probability_without_prior == favourite * ratio
    assert words in result.reason
