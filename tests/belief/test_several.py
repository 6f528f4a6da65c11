"""Several scans in one call."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from firstfix.belief.at_rest import longest_consistent
from firstfix.belief.belief import begin, update
from firstfix.belief.several import check_sequence, distinct_views, locate_several
from firstfix.belief.view import View
from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.io.maps.map_server import load_map
from firstfix.lab.simulation.lidar import Lidar

START = SE2(10.5, 2.0, 1.8)
STEPS = [SE2(0.15, 0.0, -0.175)] * 20
REST = SE2(1.0, 2.0, 0.3)


def scan_of(*ranges):
    return LaserScan(np.array(ranges), 0.0, 0.1, 0.1, 10.0)


def sequence(views):
    return [view.scans[0] for view in views], [view.T_odom_base for view in views]


def test_a_short_drive_decides_what_its_scans_do_not(halls, drive):
    scans, odometry = sequence(drive(halls.grid, START, STEPS))
    assert locate_several(scans[:1], odometry[:1], halls).verdict is Verdict.AMBIGUOUS
    result = locate_several(scans, odometry, halls)
    truth = START
    for step in STEPS:
        truth = truth @ step
    assert result.verdict is Verdict.UNIQUE
    assert result.best.pose.distance_to(truth) < 0.1
    assert angle_error(result.best.pose.yaw, truth.yaw) < math.radians(2.0)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "first"), [("olin_mac1_9_23", 30), ("uob_cs_test0", 60)])
def test_recorded_drives_seen_by_a_depth_camera_are_found(shared, case, first):
    folder = shared / "cases" / case
    fields, data = MapFields(load_map(folder / "map.yaml")), dict(np.load(folder / "scans.npz"))
    last = first + 1
    while np.hypot(*np.diff(data["odom"][first:last, :2], axis=0).T).sum() < 4.0:
        last += 1
    bearings = data["angle_min"] + data["angle_increment"] * np.arange(data["ranges"].shape[1])
    middle = 0.0 if case.startswith("olin") else float(bearings[len(bearings) // 2])
    outside = np.abs(np.remainder(bearings - middle + np.pi, 2 * np.pi) - np.pi) > np.radians(30.0)
    scans = []
    for ranges in data["ranges"][first:last].astype(np.float64):
        ranges[ranges > 5.0] = np.inf
        ranges[outside] = np.nan
        limits = float(data["range_min"]), min(5.0, float(data["range_max"]))
        scans.append(
            LaserScan(ranges, float(data["angle_min"]), float(data["angle_increment"]), *limits)
        )
    odometry = [SE2.from_array(pose) for pose in data["odom"][first:last]]
    result = locate_several(scans, odometry, fields)
    truth = SE2.from_array(data["true_pose"][last - 1])
    assert result.verdict is Verdict.UNIQUE
    assert result.best.pose.distance_to(truth) < 0.5
    assert angle_error(result.best.pose.yaw, truth.yaw) < math.radians(10.0)


def test_the_matcher_takes_several_scans(halls, drive):
    scans, odometry = sequence(drive(halls.grid, START, STEPS))
    matcher = ScanMatcher(halls.grid)
    together = matcher.locate(scans, odometry)
    expected = locate_several(scans, odometry, halls)
    assert together.verdict is Verdict.UNIQUE
    assert together.reason == expected.reason
    assert together.best.pose == expected.best.pose
    assert matcher.locate(scans[:3]).verdict is Verdict.AMBIGUOUS


def test_the_method_of_the_paper_takes_one_scan(halls):
    matcher = ScanMatcher(halls.grid, method="paper")
    with pytest.raises(InputError, match="one scan"):
        matcher.locate([scan_of(1.0), scan_of(1.0)], [REST, REST])


# --- at rest ---


def test_walking_people_are_distinguished_from_walls():
    walls, person = [3.0, 3.0, 3.0, 3.0], 1.0
    scans = []
    for at in range(4):
        ranges = list(walls)
        ranges[at] = person
        scans.append(scan_of(*ranges))
    np.testing.assert_allclose(longest_consistent(scans).ranges, walls)


def test_one_long_reading_is_an_outlier():
    scans = [scan_of(3.0, 2.0), scan_of(3.01, 2.0), scan_of(9.0, 2.0), scan_of(3.0, 2.0)]
    np.testing.assert_allclose(longest_consistent(scans).ranges, [3.01, 2.0])


def test_missing_returns_are_the_rule_or_an_exception():
    often, once = np.inf, 4.0
    merged = longest_consistent([scan_of(often, 4.0), scan_of(often, often), scan_of(once, 4.0)])
    assert merged.ranges.tolist() == [np.inf, 4.0]


def test_invalid_readings_never_count():
    merged = longest_consistent([scan_of(np.nan, np.nan), scan_of(2.0, np.nan)])
    assert merged.ranges[0] == 2.0
    assert np.isnan(merged.ranges[1])


def test_the_order_at_rest_does_not_matter():
    rng = np.random.default_rng(0)
    scans = [scan_of(*rng.uniform(0.5, 9.0, 6)) for _ in range(5)]
    forward, backward = longest_consistent(scans), longest_consistent(scans[::-1])
    np.testing.assert_array_equal(forward.ranges, backward.ranges)


def test_scans_at_rest_become_one_view():
    scans = [scan_of(3.0, 1.0), scan_of(3.0, 4.0), scan_of(3.0, 4.0), scan_of(2.0, 2.0)]
    odometry = [REST, REST, REST, REST @ SE2(0.5, 0.0, 0.0)]
    first, second = distinct_views(scans, odometry)
    np.testing.assert_allclose(first.scans[0].ranges, [3.0, 4.0])
    np.testing.assert_allclose(second.scans[0].ranges, [2.0, 2.0])


def test_a_crowd_that_walks_by_is_seen_through(room):
    lidar, rng, truth = Lidar(beams=180, sigma_m=0.01), np.random.default_rng(2), SE2(5.5, 4.5, 0.4)
    scans = []
    for i in range(8):
        scan = lidar.scan(room.grid, truth, rng)
        ranges = scan.ranges.copy()
        for person in range(3):  # each hides a ninth of the view
            at = (20 * i + 60 * person) % 180
            ranges[at : at + 20] = np.minimum(ranges[at : at + 20], 0.8)
        scans.append(replace(scan, ranges=ranges))
    result = locate_several(scans, [REST] * 8, room)
    assert result.best.evidence.explained > 0.95
    assert result.best.pose.distance_to(truth) < 0.05
    alone = locate_several(scans[:1], [REST], room)
    assert alone.best is None or alone.best.evidence.explained < 0.75


# --- what is refused ---


@pytest.mark.parametrize(
    ("stamps", "x", "word"),
    [
        ([], [], "at least one scan"),
        ([0.0, 1.0], [0.0], "2 scans and 1 poses"),
        ([1.0, 0.5], [0.0, 0.1], "0.50 s older"),
        ([0.0, 0.1], [0.0, 2.0], "a jump of 2.0 m before scan 1"),
        ([0.0, 0.0, 0.0], [0.0, 1.0, 9.0], "a jump of 8.0 m before scan 2"),
    ],
)
def test_scans_that_do_not_belong_together_are_refused(stamps, x, word):
    scans = [replace(scan_of(1.0), stamp=stamp) for stamp in stamps]
    with pytest.raises(InputError, match=word):
        check_sequence(scans, [SE2(far, 0.0, 0.0) for far in x])


# --- several sensors ---


def test_a_view_of_two_sensors_does_not_depend_on_their_order(room):
    rng, truth = np.random.default_rng(1), SE2(5.5, 4.5, 0.4)
    front = Lidar(beams=91, fov=math.pi, T_base_laser=SE2(0.3, 0.2, 0.8))
    rear = replace(front, T_base_laser=SE2(-0.3, -0.2, -2.3))
    scans = tuple(lidar.scan(room.grid, truth, rng) for lidar in (front, rear))
    one, other = (update(begin(room), View(order, REST)) for order in (scans, scans[::-1]))
    assert one.places[0].pose.distance_to(truth) < 0.05
    np.testing.assert_array_equal(one.poses, other.poses)
    np.testing.assert_array_equal(one.probabilities, other.probabilities)
