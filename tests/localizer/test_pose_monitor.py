"""A pose is believed while scans fit, doubted when they do not, and left only for good reasons."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.localizer.config import WatchConfig
from firstfix.localizer.pose_monitor import Finding, Watch, same_place

CONFIG = WatchConfig()
LIDAR = Lidar(beams=180)
HERE, THERE, THIRD = SE2(4.0, 3.0, 1.0), SE2(7.5, 1.2, -2.0), SE2(3.0, 6.0, 0.0)
ODOM = SE2(-50.0, 20.0, 2.0)  # of no meaning to the map


@pytest.fixture
def seen(hall_plan: OccupancyGrid) -> Callable[..., LaserScan]:
    rng = np.random.default_rng(0)
    return lambda pose, stamp=0.0: LIDAR.scan(hall_plan, pose, rng, stamp)


@pytest.fixture
def absurd(seen, with_ranges) -> Callable[[float], LaserScan]:
    """Give scans that see through every wall."""
    return lambda stamp: with_ranges(lambda _: 11.5)(seen(HERE, stamp))


@pytest.fixture
def searches(hall_locator, monkeypatch) -> list[float]:
    """Note the stamps of all scans that the whole map is searched for."""
    stamps, locate = [], hall_locator.locate

    def spy(scan):
        stamps.append(scan.stamp)
        return locate(scan)

    monkeypatch.setattr(hall_locator, "locate", spy)
    return stamps


@pytest.fixture
def watch(hall_locator) -> Watch:
    return Watch(hall_locator, CONFIG)


def test_the_right_pose_fits_and_asks_for_no_search(watch, seen, searches):
    for k in range(20):
        moved = SE2(0.03 * k, 0.0, 0.05 * k)
        look = watch.look(seen(HERE @ moved, 0.1 * k), ODOM @ moved, HERE @ moved)
        assert look.finding is Finding.FITS
        assert look.place.pose.distance_to(HERE @ moved) < 0.1
    assert searches == []


@pytest.mark.parametrize("moved", [SE2.identity(), SE2(0.1, 0.0, 0.1)])
def test_elsewhere_takes_two_scans_that_agree(watch, seen, moved):
    """Carried by odometry: the robot may drive meanwhile."""
    first = watch.look(seen(THERE, 0.0), ODOM, HERE)
    assert first.finding is Finding.DOUBTFUL
    assert first.place.pose.distance_to(HERE) < 0.31  # nobody has left yet
    look = watch.look(seen(THERE @ moved, 0.3), ODOM @ moved, HERE @ moved)
    assert look.finding is Finding.ELSEWHERE
    assert look.place.pose.distance_to(THERE @ moved) < 0.05
    assert angle_error(look.place.pose.yaw, (THERE @ moved).yaw) < math.radians(1.0)


def test_two_scans_that_disagree_move_nobody(watch, seen):
    findings = [
        watch.look(seen(pose, 0.25 * k), ODOM, HERE).finding
        for k, pose in enumerate([THERE, THIRD] * 4)
    ]
    assert findings == [Finding.DOUBTFUL] * 8


def test_two_scans_that_disagree_with_odometry_move_nobody(watch, seen):
    """The same place twice, although the robot says that it has driven 1 m."""
    assert watch.look(seen(THERE, 0.0), ODOM, HERE).finding is Finding.DOUBTFUL
    moved = SE2(1.0, 0.0, 0.0)
    assert watch.look(seen(THERE, 0.3), ODOM @ moved, HERE @ moved).finding is Finding.DOUBTFUL


def test_a_scan_that_fits_between_them_begins_the_count_anew(watch, seen):
    findings = [
        watch.look(seen(pose, 0.3 * k), ODOM, HERE).finding
        for k, pose in enumerate([THERE, HERE, THERE, THERE])
    ]
    assert findings == [Finding.DOUBTFUL, Finding.FITS, Finding.DOUBTFUL, Finding.ELSEWHERE]


def test_as_many_scans_are_asked_for_as_one_likes(hall_locator, seen):
    watch = Watch(hall_locator, WatchConfig(confirmations=4))
    findings = [watch.look(seen(THERE, 0.3 * k), ODOM, HERE).finding for k in range(4)]
    assert findings == [Finding.DOUBTFUL] * 3 + [Finding.ELSEWHERE]


@pytest.mark.parametrize(("metres", "degrees"), [(0.4, 15.0), (0.5, 20.0), (0.6, 25.0)])
def test_a_small_slip_needs_no_search(watch, hall_plan, seen, searches, metres, degrees):
    rng = np.random.default_rng(0)
    for truth in random_free_poses(hall_plan, rng, 5, 0.8):
        towards, turn = rng.uniform(-math.pi, math.pi), rng.choice([-1.0, 1.0])
        slip = SE2(metres * math.cos(towards), metres * math.sin(towards), 0.0)
        tracked = truth @ slip @ SE2(0.0, 0.0, turn * math.radians(degrees))
        assert watch.look(seen(truth, 0.0), ODOM, tracked).finding is Finding.DOUBTFUL
        look = watch.look(seen(truth, 0.1), ODOM, tracked)
        assert look.finding is Finding.ELSEWHERE
        assert look.place.pose.distance_to(truth) < 0.05
    assert searches == []


def test_contradiction_must_last(watch, absurd):
    findings = [(0.1 * k, watch.look(absurd(0.1 * k), ODOM, HERE).finding) for k in range(32)]
    for stamp, finding in findings:
        lost = stamp >= CONFIG.lost_after_s
        assert finding is (Finding.CONTRADICTED if lost else Finding.DOUBTFUL)
    assert any(finding is Finding.CONTRADICTED for _, finding in findings)


@pytest.mark.slow
@pytest.mark.parametrize("off", [SE2.identity(), SE2(0.2, 0.0, 0.0)])
def test_one_good_scan_ends_a_contradiction(watch, absurd, seen, off):
    """Also where the track is a little off, and would be put right by a second one."""
    for k in range(60):
        good = k % 18 == 17
        scan = seen(HERE, 0.1 * k) if good else absurd(0.1 * k)
        finding = watch.look(scan, ODOM, HERE @ off).finding
        assert finding is (Finding.FITS if good else Finding.DOUBTFUL)


@pytest.mark.slow
def test_the_whole_map_is_not_searched_for_every_scan(watch, absurd, searches):
    for k in range(100):
        watch.look(absurd(0.02 * k), ODOM, HERE)
    assert 8 <= len(searches) <= 11  # 2 s, one in 0.2 s
    assert np.diff(searches).min() >= CONFIG.search_period_s - 1e-9


def test_a_clock_that_goes_back_stops_no_search(watch, absurd, searches):
    for stamp in (1000.0, 10.0, 10.3):
        watch.look(absurd(stamp), ODOM, HERE)
    assert searches == [1000.0, 10.0, 10.3]


def test_a_scan_that_says_nothing_does_not_fit(watch, seen, with_ranges):
    empty = with_ranges(lambda _: math.nan)(seen(HERE))
    assert watch.look(empty, ODOM, HERE).finding is not Finding.FITS


@pytest.mark.parametrize("beams", [1, 2, 5, 7])
def test_a_few_beams_move_nobody(office, office_locator, with_ranges, beams):
    """For a search 8 hits are needed; less must not do nearby."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        (pose,) = random_free_poses(office, rng, 1, 0.4)
        kept = rng.permutation(180)[:beams]
        ranges = np.full(180, np.nan)
        ranges[kept] = rng.uniform(0.3, 8.0, beams)
        watch = Watch(office_locator, CONFIG)
        for k in range(5):
            scan = with_ranges(lambda _, r=ranges: r)(LIDAR.scan(office, pose, rng, 0.1 * k))
            assert watch.look(scan, ODOM, pose).finding is not Finding.ELSEWHERE


@pytest.mark.parametrize(
    ("off", "same"),
    [
        (SE2(0.49, 0.0, 0.0), True),
        (SE2(0.0, -0.51, 0.0), False),
        (SE2(0.0, 0.0, math.radians(14.9)), True),
        (SE2(0.0, 0.0, math.radians(-14.9)), True),
        (SE2(0.0, 0.0, math.radians(15.1)), False),
        (SE2(0.0, 0.0, math.radians(-15.1)), False),
        (SE2(0.3, 0.3, math.radians(10.0)), True),
        (SE2(0.0, 0.0, math.pi), False),
    ],
)
@pytest.mark.parametrize("yaw", [0.0, 3.1, -3.1])
def test_one_place_is_half_a_metre_and_fifteen_degrees(off, same, yaw):
    pose = SE2(10.0, -3.0, yaw)
    assert same_place(pose, pose @ off, CONFIG) is same
    assert same_place(pose @ off, pose, CONFIG) is same
