"""The tracked pose is accepted while scans fit, doubted when they do not, and given up at last."""

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
from firstfix.localizer.config import MonitorConfig
from firstfix.localizer.pose_monitor import Fit, PoseMonitor

CONFIG = MonitorConfig()
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
        stamps.append(scan[0].stamp)
        return locate(scan)

    monkeypatch.setattr(hall_locator, "locate", spy)
    return stamps


@pytest.fixture
def monitor(hall_locator) -> PoseMonitor:
    return PoseMonitor(hall_locator, CONFIG)


def test_the_right_pose_is_consistent_and_needs_no_search(monitor, seen, searches):
    for k in range(20):
        moved = SE2(0.03 * k, 0.0, 0.05 * k)
        judged = monitor.judge(seen(HERE @ moved, 0.1 * k), ODOM @ moved, HERE @ moved)
        assert judged.fit is Fit.CONSISTENT
        assert judged.place.pose.distance_to(HERE @ moved) < 0.1
    assert searches == []


@pytest.mark.parametrize("moved", [SE2.identity(), SE2(0.1, 0.0, 0.1)])
def test_moving_to_another_place_takes_two_scans_that_agree(monitor, seen, moved):
    """Carried by odometry: the robot may drive meanwhile."""
    first = monitor.judge(seen(THERE, 0.0), ODOM, HERE)
    assert first.fit is Fit.DOUBTFUL
    assert first.place.pose.distance_to(HERE) < 0.31  # the pose is kept so far
    judged = monitor.judge(seen(THERE @ moved, 0.3), ODOM @ moved, HERE @ moved)
    assert judged.fit is Fit.ELSEWHERE
    assert judged.place.pose.distance_to(THERE @ moved) < 0.05
    assert angle_error(judged.place.pose.yaw, (THERE @ moved).yaw) < math.radians(1.0)


def test_two_scans_that_disagree_do_not_move_the_pose(monitor, seen):
    fits = [
        monitor.judge(seen(pose, 0.25 * k), ODOM, HERE).fit
        for k, pose in enumerate([THERE, THIRD] * 4)
    ]
    assert fits == [Fit.DOUBTFUL] * 8


def test_two_scans_that_disagree_with_odometry_do_not_move_the_pose(monitor, seen):
    """The same place twice, although odometry has moved by 1 m."""
    assert monitor.judge(seen(THERE, 0.0), ODOM, HERE).fit is Fit.DOUBTFUL
    moved = SE2(1.0, 0.0, 0.0)
    assert monitor.judge(seen(THERE, 0.3), ODOM @ moved, HERE @ moved).fit is Fit.DOUBTFUL


def test_a_consistent_scan_in_between_restarts_the_count(monitor, seen):
    fits = [
        monitor.judge(seen(pose, 0.3 * k), ODOM, HERE).fit
        for k, pose in enumerate([THERE, HERE, THERE, THERE])
    ]
    assert fits == [Fit.DOUBTFUL, Fit.CONSISTENT, Fit.DOUBTFUL, Fit.ELSEWHERE]


def test_the_number_of_confirmations_is_a_setting(hall_locator, seen):
    monitor = PoseMonitor(hall_locator, MonitorConfig(confirmations=4))
    fits = [monitor.judge(seen(THERE, 0.3 * k), ODOM, HERE).fit for k in range(4)]
    assert fits == [Fit.DOUBTFUL] * 3 + [Fit.ELSEWHERE]


@pytest.mark.parametrize(("metres", "degrees"), [(0.4, 15.0), (0.5, 20.0), (0.6, 25.0)])
def test_a_small_slip_needs_no_search(monitor, hall_plan, seen, searches, metres, degrees):
    rng = np.random.default_rng(0)
    for truth in random_free_poses(hall_plan, rng, 5, 0.8):
        towards, turn = rng.uniform(-math.pi, math.pi), rng.choice([-1.0, 1.0])
        slip = SE2(metres * math.cos(towards), metres * math.sin(towards), 0.0)
        tracked = truth @ slip @ SE2(0.0, 0.0, turn * math.radians(degrees))
        assert monitor.judge(seen(truth, 0.0), ODOM, tracked).fit is Fit.DOUBTFUL
        judged = monitor.judge(seen(truth, 0.1), ODOM, tracked)
        assert judged.fit is Fit.ELSEWHERE
        assert judged.place.pose.distance_to(truth) < 0.05
    assert searches == []


@pytest.mark.parametrize("sigma", [0.01, 0.3])
def test_what_the_filter_allows_for_is_not_corrected(monitor, seen, sigma):
    """Along a corridor the best pose of one scan follows people who walk there."""
    covariance = np.diag([sigma, sigma, 0.02]) ** 2
    off = HERE @ SE2(0.2, 0.0, 0.0)
    fits = [monitor.judge(seen(HERE, 0.1 * k), ODOM, off, covariance).fit for k in range(4)]
    assert (Fit.ELSEWHERE in fits) is (sigma < 0.1)


@pytest.mark.parametrize("room", [0, 1])
def test_a_slip_among_equal_rooms_may_be_a_kidnap(three_rooms, three_rooms_locator, room):
    """In a room that has no equal it is followed; here it is not known which room this is."""
    monitor, rng = PoseMonitor(three_rooms_locator, CONFIG), np.random.default_rng(0)
    here = SE2(2.5, 1.2, 0.3)
    there = here @ SE2(0.4, 0.0, math.radians(15.0))
    there = SE2(there.x + 8.0 * room, there.y, there.yaw)
    fits = []
    for k in range(6):
        scan = LIDAR.scan(three_rooms, here if k < 3 else there, rng, 0.1 * k)
        fits.append(monitor.judge(scan, ODOM, here).fit)
    assert fits[:5] == [*3 * [Fit.CONSISTENT], Fit.DOUBTFUL, Fit.CONTRADICTED]


def test_a_pose_that_fits_again_where_it_was_contradicted_stays(monitor, seen, absurd):
    fits = []
    for k in range(40):
        scan = absurd(0.1 * k) if 5 <= k < 8 else seen(HERE, 0.1 * k)
        fits.append(monitor.judge(scan, ODOM, HERE).fit)
    assert fits == [*5 * [Fit.CONSISTENT], *3 * [Fit.DOUBTFUL], *32 * [Fit.CONSISTENT]]


def test_particles_that_move_to_an_equal_room_nearby_do_not_end_a_contradiction(
    three_rooms, three_rooms_locator
):
    monitor, rng = PoseMonitor(three_rooms_locator, CONFIG), np.random.default_rng(0)
    here, beside = SE2(2.5, 1.2, 0.3), SE2(3.5, 1.2, 0.3)
    fits = []
    for k in range(30):
        truth, tracked = (here, here) if k < 3 else (beside, here if k < 4 else beside)
        scan = LIDAR.scan(three_rooms, truth, rng, 0.1 * k)
        fits.append(monitor.judge(scan, ODOM, tracked).fit)
    assert fits[2:5] == [Fit.CONSISTENT, Fit.DOUBTFUL, Fit.CONSISTENT]
    lost = fits.index(Fit.CONTRADICTED)
    assert 0.1 * (lost - 3) == pytest.approx(CONFIG.lost_after_s, abs=0.11)


def test_a_fit_that_is_suddenly_worse_is_reported(monitor, seen, absurd):
    for k in range(5):
        assert not monitor.judge(seen(HERE, 0.1 * k), ODOM, HERE).is_sudden
    assert monitor.judge(absurd(0.5), ODOM, HERE).is_sudden


def test_contradiction_must_last(monitor, absurd):
    fits = [(0.1 * k, monitor.judge(absurd(0.1 * k), ODOM, HERE).fit) for k in range(32)]
    for stamp, fit in fits:
        lost = stamp >= CONFIG.lost_after_s
        assert fit is (Fit.CONTRADICTED if lost else Fit.DOUBTFUL)
    assert any(fit is Fit.CONTRADICTED for _, fit in fits)


@pytest.mark.slow
@pytest.mark.parametrize("off", [SE2.identity(), SE2(0.2, 0.0, 0.0)])
def test_one_good_scan_ends_a_contradiction(monitor, absurd, seen, off):
    """Also where the track is a little off, and would be put right by a second one."""
    for k in range(60):
        good = k % 18 == 17
        scan = seen(HERE, 0.1 * k) if good else absurd(0.1 * k)
        fit = monitor.judge(scan, ODOM, HERE @ off).fit
        assert fit is (Fit.CONSISTENT if good else Fit.DOUBTFUL)


@pytest.mark.slow
def test_the_whole_map_is_not_searched_for_every_scan(monitor, absurd, searches):
    for k in range(100):
        monitor.judge(absurd(0.02 * k), ODOM, HERE)
    assert 8 <= len(searches) <= 11  # 2 s, one in 0.2 s
    assert np.diff(searches).min() >= CONFIG.search_period_s - 1e-9


def test_a_clock_that_goes_back_stops_no_search(monitor, absurd, searches):
    for stamp in (1000.0, 10.0, 10.3):
        monitor.judge(absurd(stamp), ODOM, HERE)
    assert searches == [1000.0, 10.0, 10.3]


@pytest.mark.parametrize("ranges", [math.nan, 0.0, 0.02, math.inf], ids=str)
def test_a_covered_sensor_is_uninformative_however_long(monitor, seen, with_ranges, ranges):
    """Too close, too far, or no return at all: no evidence against the pose."""
    for k in range(50):
        covered = with_ranges(lambda _: ranges)(seen(HERE, 0.1 * k))
        assert monitor.judge(covered, ODOM, HERE).fit is Fit.UNINFORMATIVE
    assert monitor.judge(seen(HERE, 5.0), ODOM, HERE).fit is Fit.CONSISTENT


@pytest.mark.parametrize("beams", [1, 2, 5, 7])
def test_a_few_beams_do_not_move_the_pose(office, office_locator, with_ranges, beams):
    """A search needs 8 hits; a local search must not do with fewer."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        (pose,) = random_free_poses(office, rng, 1, 0.4)
        kept = rng.permutation(180)[:beams]
        ranges = np.full(180, np.nan)
        ranges[kept] = rng.uniform(0.3, 8.0, beams)
        monitor = PoseMonitor(office_locator, CONFIG)
        for k in range(5):
            scan = with_ranges(lambda _, r=ranges: r)(LIDAR.scan(office, pose, rng, 0.1 * k))
            assert monitor.judge(scan, ODOM, pose).fit is not Fit.ELSEWHERE
