"""Several sensors of one robot in one answer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan, as_scans
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.sensors import at_one_time, instants, joint_beams
from firstfix.global_localization.verify import verify
from firstfix.lab.simulation.lidar import Lidar

FRONT = Lidar(
    beams=270, fov=math.radians(270.0), range_max=8.0, T_base_laser=SE2(0.4, 0.3, math.pi / 4)
)
REAR = replace(FRONT, T_base_laser=SE2(-0.4, -0.3, math.radians(-135.0)))
TRUTH = SE2(2.0, 2.5, 0.6)


@pytest.fixture(scope="module")
def matcher(draw_room):
    return ScanMatcher(draw_room(0.05))


def two_scans(grid, pose, front=FRONT, rear=REAR):
    rng = np.random.default_rng(0)
    return [lidar.scan(grid, pose, rng) for lidar in (front, rear)]


def halves(scan):
    n = len(scan) // 2
    second = scan.angle_min + n * scan.angle_increment
    return [
        replace(scan, ranges=scan.ranges[:n]),
        replace(scan, ranges=scan.ranges[n:], angle_min=second),
    ]


def test_two_halves_of_a_scan_give_the_answer_of_the_whole(matcher, found):
    scan = Lidar(beams=180).scan(matcher.fields.grid, TRUTH, np.random.default_rng(1))
    whole, parts = matcher.locate(scan), matcher.locate(halves(scan))
    assert parts.verdict is whole.verdict is Verdict.UNIQUE
    assert found(parts, whole.best.pose, 1e-3, 0.05)
    assert parts.best.probability == pytest.approx(whole.best.probability, abs=1e-3)
    assert parts.best.evidence == whole.best.evidence


def test_two_sensors_at_two_corners_find_the_robot(matcher, found):
    for pose in (TRUTH, SE2(7.0, 5.5, -2.0), SE2(4.5, 3.5, 3.0)):
        scans = two_scans(matcher.fields.grid, pose)
        result = matcher.locate(scans)
        assert result.verdict is Verdict.UNIQUE
        assert found(result, pose, 0.05, 1.0)
        assert result.scans == tuple(scans)


def test_sensors_count_by_how_often_they_look_to_all_sides(draw_room):
    scans = two_scans(draw_room(0.05), TRUTH)
    assert joint_beams(scans)[1].turns == pytest.approx(1.5, abs=0.01)
    assert joint_beams(halves(scans[0]))[1].turns == pytest.approx(0.75, abs=0.01)
    assert joint_beams(scans[:1])[1].turns == 1.0


def test_the_order_of_sensors_does_not_matter(matcher, content_of):
    scans = two_scans(matcher.fields.grid, TRUTH)
    assert content_of(matcher.locate(scans)) == content_of(matcher.locate(scans[::-1]))


def test_a_list_of_one_scan_is_that_scan(matcher, content_of):
    scan = two_scans(matcher.fields.grid, TRUTH)[0]
    assert content_of(matcher.locate([scan])) == content_of(matcher.locate(scan))
    assert matcher.locate([scan]).scans == (scan,)
    blind = replace(scan, ranges=np.full(len(scan), np.nan))
    assert matcher.locate(blind).scans == (blind,)


def test_two_narrow_sensors_decide_what_one_does_not(halls_matcher, found):
    """The pillar that one hall has and the other has not is behind the robot."""
    narrow = Lidar(beams=91, fov=math.radians(90.0), range_max=12.0, sigma_m=0.01)
    behind = replace(narrow, T_base_laser=SE2(-0.2, 0.0, math.pi))
    pose = SE2(10.0, 2.0, math.pi)
    front, rear = two_scans(halls_matcher.fields.grid, pose, narrow, behind)
    assert halls_matcher.locate(front).best.probability < 0.6
    both = halls_matcher.locate([front, rear])
    assert both.verdict is Verdict.UNIQUE
    assert found(both, pose, 0.1, 2.0)


@pytest.fixture(scope="module")
def halls_matcher():
    from firstfix.lab.worlds.drawing import Drawing

    plan = Drawing(15.0, 6.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 6.0, 4.0)
    plan.room(7.0, 0.0, 13.0, 4.0)
    for x in (0.0, 7.0):
        plan.solid(x + 2.0, 3.2, x + 2.6, 3.9)
        plan.solid(x + 0.1, 0.1, x + 0.8, 1.2)
    plan.solid(12.0, 1.5, 12.9, 2.6)
    return ScanMatcher(plan.grid())


def test_beams_are_judged_from_their_own_origins(matcher):
    """A pillar hides from one sensor what the other sees; no ray begins where no sensor is."""
    grid = matcher.fields.grid
    scans = two_scans(grid, TRUTH, replace(FRONT, sigma_m=0.0), replace(REAR, sigma_m=0.0))
    reference, beams = joint_beams(scans)
    pose = (grid.T_map_grid.inverse() @ TRUTH @ reference.T_base_laser).as_array()
    pose[:2] /= grid.resolution
    joint = verify(pose[None], beams, matcher.fields).evidence(0)
    assert joint.explained == 1.0
    virtual = replace(beams, origins=None)
    assert verify(pose[None], virtual, matcher.fields).evidence(0).explained < 0.9


def test_end_points_of_joint_beams_are_those_of_the_scans():
    scans = [
        LaserScan(np.array([2.0, 3.0, 4.0]), -0.5, 0.5, 0.1, 10.0, T_base_laser=SE2(0.4, 0.1, 0.3)),
        LaserScan(np.array([1.0, 5.0]), 1.0, 0.2, 0.1, 10.0, T_base_laser=SE2(-0.3, 0.0, 3.0)),
    ]
    reference, beams = joint_beams(scans)
    assert reference is scans[0]
    ends = reference.T_base_laser.apply(beams.ends)
    np.testing.assert_allclose(ends, np.vstack([scan.points() for scan in scans]), atol=1e-12)
    assert len(beams.from_origin()) == 3


def test_one_sensor_has_the_beams_that_it_had():
    scan = LaserScan(np.array([2.0, np.inf, np.nan]), -0.5, 0.5, 0.1, 10.0)
    _, beams = joint_beams([scan])
    assert beams.origins is None
    np.testing.assert_array_equal(beams.ranges, usable_beams(scan).ranges)


def test_odometry_moves_sensors_to_the_newest_scan(matcher, found):
    earlier, later = TRUTH, TRUTH @ SE2(0.2, 0.05, 0.3)
    grid, rng = matcher.fields.grid, np.random.default_rng(4)
    scans = [REAR.scan(grid, later, rng, stamp=0.2), FRONT.scan(grid, earlier, rng, stamp=0.1)]
    odometry = [SE2(5.0, 5.0, 1.0) @ TRUTH.inverse() @ pose for pose in (later, earlier)]
    moved = matcher.locate(scans, T_odom_base=odometry)
    assert moved.verdict is Verdict.UNIQUE
    assert found(moved, later, 0.05, 1.0)
    assert moved.best.score < matcher.locate(scans).best.score
    at_once = at_one_time(scans, odometry)
    assert at_once[0].T_base_laser.distance_to(REAR.T_base_laser) < 1e-9


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda scan: as_scans([]), "no scan in the list"),
        (lambda scan: as_scans([scan, 3]), "expected scan as a LaserScan"),
        (lambda scan: at_one_time([scan], []), "1 scans and 0 poses"),
        (lambda scan: at_one_time([scan] * 2, [SE2(0, 0, 0), SE2(3, 0, 0)]), "over 3.0 m"),
    ],
)
def test_sensors_that_do_not_belong_together_are_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(LaserScan(np.array([1.0]), 0.0, 0.1, 0.1, 10.0))


def test_scans_of_one_sensor_are_of_different_instants():
    a = LaserScan(np.array([1.0, 1.0]), 0.0, 0.5, 0.1, 10.0)
    b = replace(a, T_base_laser=SE2(1.0, 0.0, 0.0))
    other_way = replace(a, angle_min=3.0)
    assert instants([a, b, other_way]) == [[0, 1, 2]]
    assert instants([a, b, a, b]) == [[0, 1], [2, 3]]
    assert instants([a, a]) == [[0], [1]]


def test_two_sensors_are_judged_together_over_a_drive(halls_matcher, found):
    narrow = Lidar(beams=91, fov=math.radians(90.0), range_max=12.0, sigma_m=0.01)
    behind = replace(narrow, T_base_laser=SE2(-0.2, 0.0, math.pi))
    grid, rng, pose = halls_matcher.fields.grid, np.random.default_rng(5), SE2(10.0, 2.0, math.pi)
    scans, odometry = [], []
    for i in range(8):
        pose = pose @ SE2(0.05, 0.0, 0.1)
        lidar = (narrow, behind)[i % 2]
        scans.append(lidar.scan(grid, pose, rng, stamp=0.1 * i))
        odometry.append(SE2(1.0, 2.0, 0.5) @ pose)
    result = halls_matcher.locate(scans, T_odom_base=odometry)
    assert result.verdict is Verdict.UNIQUE
    assert found(result, pose, 0.1, 2.0)
    assert len(result.scans) == 2


def test_the_methods_of_the_paper_take_one_sensor(draw_room):
    matcher = ScanMatcher(draw_room(0.05), method="paper")
    with pytest.raises(InputError, match="for several scans"):
        matcher.locate(two_scans(matcher.fields.grid, TRUTH))
