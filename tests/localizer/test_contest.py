"""Several places: twins stay twins, what differs decides, and strangers are noticed."""

from __future__ import annotations

import math
from itertools import count

import numpy as np
import pytest

from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.config import MonitorConfig
from firstfix.localizer.contest import Contest, Standing

CONFIG = MonitorConfig()
POSE = SE2(2.5, 2.0, 0.0)
ODOM = SE2(-50.0, 20.0, 2.0)  # of no meaning to the map
TURN = SE2(0.0, 0.0, 0.6)


def begun(matcher, pose, lidar, rng):
    """Begin a contest with what one scan leaves open."""
    result = matcher.locate(lidar.scan(matcher.fields.grid, pose, rng))
    assert result.verdict is Verdict.AMBIGUOUS
    return Contest(result.hypotheses, ODOM, matcher, CONFIG, count(1))


def turning(contest, world, pose, lidar, rng, looks):
    """Yield how it stands after each look of a robot that moves on between them."""
    T_odom_base = ODOM
    for _ in range(looks):
        pose, T_odom_base = pose @ TURN, T_odom_base @ TURN
        yield contest.look(lidar.scan(world, pose, rng), T_odom_base), pose


@pytest.mark.parametrize(
    ("moved", "news"),
    [
        (SE2.identity(), False),
        (SE2(0.49, 0.0, 0.0), False),
        (SE2(0.3, -0.41, 0.0), True),
        (SE2(-0.51, 0.0, 0.0), True),
        (SE2(0.0, 0.0, math.radians(29.0)), False),
        (SE2(0.0, 0.0, math.radians(-31.0)), True),
        (SE2(0.0, 0.0, math.pi), True),
    ],
)
def test_motion_brings_news(three_rooms_locator, moved, news):
    rng = np.random.default_rng(0)
    contest = begun(three_rooms_locator, POSE, Lidar(beams=180), rng)
    assert contest.brings_news(ODOM @ moved) is news
    # From the last look on, not from the beginning.
    seen = Lidar(beams=180).scan(three_rooms_locator.fields.grid, POSE @ moved, rng)
    contest.look(seen, ODOM @ moved)
    assert not contest.brings_news(ODOM @ moved)


@pytest.mark.parametrize("seed", range(3))
def test_twins_stay_twins_however_often_one_looks(three_rooms, three_rooms_locator, seed):
    """Nothing in the rooms tells them apart, so nothing may decide."""
    lidar, rng = Lidar(beams=180), np.random.default_rng(seed)
    pose = SE2(10.5, 1.2, 0.3)
    contest = begun(three_rooms_locator, pose, lidar, rng)
    for standing, at in turning(contest, three_rooms, pose, lidar, rng, 25):
        assert standing is Standing.OPEN
        places = contest.places
        assert sum(place.probability for place in places) == pytest.approx(1.0)
        best = places[:3]
        assert [round(at.x - place.pose.x) % 8 for place in best] == [0, 0, 0]
        assert len({round(place.pose.x) for place in best}) == 3
        assert max(place.probability for place in best) < 0.6


def test_a_look_at_rest_tells_where_the_places_are_by_now(three_rooms, three_rooms_locator):
    """A robot that creeps on brings no news for a while; its places creep on with it."""
    lidar, rng = Lidar(beams=180), np.random.default_rng(0)
    contest = begun(three_rooms_locator, POSE, lidar, rng)
    [(_, pose)] = turning(contest, three_rooms, POSE, lidar, rng, 1)
    crept = SE2(0.3, 0.0, 0.3)
    assert not contest.brings_news(ODOM @ TURN @ crept)
    seen = lidar.scan(three_rooms, pose @ crept, rng)
    assert contest.look_at_rest(seen, ODOM @ TURN @ crept) is Standing.OPEN
    best = contest.places[:3]
    assert sorted(round(place.pose.x - (pose @ crept).x) for place in best) == [0, 8, 16]
    for place in best:
        room = SE2(round(place.pose.x - (pose @ crept).x), 0.0, 0.0)
        assert place.pose.distance_to(room @ pose @ crept) < 0.1


@pytest.mark.parametrize("room", [0.0, 7.0])
@pytest.mark.parametrize("seed", range(3))
def test_what_differs_decides_rightly(two_rooms, two_rooms_locator, half_lidar, room, seed):
    rng = np.random.default_rng(seed)
    pose = SE2(room, 0.0, 0.0) @ POSE
    contest = begun(two_rooms_locator, pose, half_lidar, rng)
    for standing, at in turning(contest, two_rooms, pose, half_lidar, rng, 10):
        if standing is not Standing.OPEN:
            assert standing is Standing.WON
            assert contest.places[0].pose.distance_to(at) < 0.1
            return
    raise AssertionError("nothing was decided in a whole turn")


def test_places_are_ranked_and_make_up_all(two_rooms, two_rooms_locator, half_lidar):
    rng = np.random.default_rng(0)
    contest = begun(two_rooms_locator, POSE, half_lidar, rng)
    for _ in turning(contest, two_rooms, POSE, half_lidar, rng, 3):
        shares = [place.probability for place in contest.places]
        assert shares == sorted(shares, reverse=True)
        assert sum(shares) == pytest.approx(1.0)


def test_who_is_elsewhere_does_not_win_where_the_places_were(
    hall_plan, hall_locator, two_rooms_locator
):
    """The list holds only wrong places: the robot was carried away meanwhile."""
    lidar, rng = Lidar(beams=180), np.random.default_rng(0)
    pose = SE2(4.0, 3.0, 1.0)
    listed = hall_locator.locate(lidar.scan(hall_plan, pose, rng)).hypotheses
    wrong = tuple(place for place in listed if place.pose.distance_to(pose) > 1.0)
    assert len(wrong) >= 2
    contest = Contest(wrong, ODOM, hall_locator, CONFIG, count(1))
    for standing, at in turning(contest, hall_plan, pose, lidar, rng, 6):
        if standing is Standing.WON:
            assert contest.places[0].pose.distance_to(at) < 0.1
        if standing is not Standing.OPEN:
            return
    raise AssertionError("neither lost nor found")


@pytest.mark.slow
def test_in_a_foreign_building_nothing_wins(hall_plan, office_locator):
    """A hall on the map of the office: about two thirds of the beams fit some room."""
    lidar = Lidar(beams=180)
    for seed, pose in enumerate([SE2(4.0, 3.0, 1.0), SE2(3.0, 2.0, 0.0), SE2(7.5, 5.0, -2.0)]):
        rng = np.random.default_rng(seed)
        result = office_locator.locate(lidar.scan(hall_plan, pose, rng))
        if result.verdict is not Verdict.AMBIGUOUS:
            continue
        contest = Contest(result.hypotheses, ODOM, office_locator, CONFIG, count(1))
        for standing, _ in turning(contest, hall_plan, pose, lidar, rng, 12):
            assert standing is not Standing.WON
            if standing is Standing.LOST:
                break
