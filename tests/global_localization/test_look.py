"""Looks find the places that the search of all poses finds."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.core.angles import FULL_TURN
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.fields.look_table import LOOK_DIRECTIONS
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.config import MAX_POSES, LocateConfig
from firstfix.global_localization.locate import locate
from firstfix.global_localization.look import (
    BEAMS,
    find_places,
    look_at,
    look_into,
)
from firstfix.global_localization.search import SECTORS, search
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.house import house
from firstfix.lab.worlds.office import office

POSES = [SE2(3.0, 12.1, 0.3), SE2(30.0, 16.0, -2.0), SE2(16.0, 8.0, 1.2)]


@pytest.fixture(scope="module")
def fields() -> MapFields:
    return MapFields(office(), most_positions=0)


def scan_at(pose, **sensor):
    lidar = Lidar(sigma_m=0.02, **sensor)
    return lidar.scan(office(), pose, np.random.default_rng(0))


def slow_scores(beams, fields):
    """Compare every heading of every entry, one by one."""
    table = fields.look
    exact = beams.bearings / FULL_TURN * LOOK_DIRECTIONS
    nearest = {}
    for i in np.argsort(np.abs(exact - np.rint(exact)), kind="stable"):
        nearest.setdefault(int(np.rint(exact[i])) % LOOK_DIRECTIONS, i)
    directions = np.array(sorted(nearest))
    directions = directions[
        np.linspace(0, len(directions) - 1, min(BEAMS, len(directions))).round().astype(int)
    ]
    costs = np.zeros((len(table), LOOK_DIRECTIONS))
    for heading in range(LOOK_DIRECTIONS):
        for direction in directions:
            i = nearest[int(direction)]
            low, high = table.bounds[:, :, (direction + heading) % LOOK_DIRECTIONS].T.astype(int)
            count = min(int(np.rint(beams.ranges[i] / 0.1)), 250)
            costs[:, heading] += np.clip(count - high, 0, 10 if beams.hit[i] else 5)
            costs[:, heading] += np.clip(low - count, 0, 4 if beams.hit[i] else 0)
    best = costs.reshape(len(table), SECTORS, -1).min(axis=2)
    return best + np.rint(0.25 * len(directions) / 64.0 * table.spreads)[:, None]


@pytest.mark.parametrize("sensor", [{}, {"fov": 2.0, "beams": 100, "range_max": 5.0}])
def test_the_kernel_is_the_slow_comparison(fields: MapFields, sensor) -> None:
    beams = usable_beams(scan_at(POSES[0], **sensor))
    (looked,), _ = look_at(beams, [fields], 10**9)
    np.testing.assert_array_equal(looked.scores, np.minimum(slow_scores(beams, fields), 1023))


@pytest.mark.parametrize("kept", [1, 300, 3000])
def test_what_is_dropped_early_would_not_have_been_kept(fields: MapFields, kept: int) -> None:
    beams = usable_beams(scan_at(POSES[1]))
    maps = [MapFields(house(), most_positions=0), fields]
    whole, _ = look_at(beams, maps, 10**9)
    looked, limit = look_at(beams, maps, kept)
    for all_of_map, of_map in zip(whole, looked, strict=True):
        kept_early = np.minimum(of_map.scores, limit + 1)
        np.testing.assert_array_equal(kept_early, np.minimum(all_of_map.scores, limit + 1))
    assert np.count_nonzero(looked[1].scores == 1023) > 0


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("sensor", [{}, {"fov": 4.2, "range_max": 8.0}])
def test_the_best_place_is_that_of_the_search(fields: MapFields, pose: SE2, sensor) -> None:
    beams = usable_beams(scan_at(pose, **sensor))
    by_search, report = search(beams, fields, 150, MAX_POSES)
    by_looks, looked = find_places(beams, fields, 150, MAX_POSES)
    assert report.proven
    assert not looked.proven
    assert looked.searched == 1.0
    assert np.hypot(*(by_search.poses[0] - by_looks.poses[0])[:2]) * 0.05 < 0.6
    assert abs(by_search.scores[0] - by_looks.scores[0]) < 0.05
    assert (np.diff(by_looks.scores) >= 0.0).all()


def test_a_large_map_is_located_in_like_a_small_one(fields: MapFields) -> None:
    for pose in POSES:
        result = locate((scan_at(pose),), fields, LocateConfig())
        assert result.verdict is Verdict.UNIQUE
        assert result.best is not None
        assert result.best.pose.distance_to(pose) < 0.1


def test_a_small_map_is_searched_whole() -> None:
    small = MapFields(office())
    beams = usable_beams(scan_at(POSES[0]))
    by_search, _ = search(beams, small, 20, MAX_POSES)
    found, report = find_places(beams, small, 20, MAX_POSES)
    assert report.proven
    np.testing.assert_array_equal(found.poses, by_search.poses)
    assert "look" not in vars(small)


def test_the_right_map_of_several_has_the_best_place(fields: MapFields) -> None:
    beams = usable_beams(scan_at(POSES[1]))
    elsewhere, here = look_into(beams, [MapFields(house(), most_positions=0), fields], 10)
    assert here.scores[0] < elsewhere.scores.min(initial=np.inf)


def test_the_limit_keeps_about_as_many_as_asked(fields: MapFields) -> None:
    for kept in (1, 300, 3000, 10**9):
        (looked,), limit = look_at(usable_beams(scan_at(POSES[0])), [fields], kept)
        best = np.count_nonzero(looked.scores == looked.scores.min())
        assert 1 <= np.count_nonzero(looked.scores <= limit) <= max(kept, best)


def test_a_scan_without_hits_in_reach_is_no_failure(fields: MapFields) -> None:
    beams = usable_beams(scan_at(POSES[0], range_max=0.3))
    found = look_into(beams, [fields], 10)[0]
    assert len(found.poses) <= 10
