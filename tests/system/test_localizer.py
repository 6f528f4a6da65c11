"""The system as whoever uses it sees it: inputs in, poses and reasons out."""

from __future__ import annotations

import copy
import dataclasses
import math

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.errors import MapError
from firstfix.core.grid import FREE, OccupancyGrid
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.locate import Locator
from firstfix.sim.lidar import Lidar
from firstfix.sim.phases import CarryTo, DriveTo, Stand, Teleport
from firstfix.sim.scenario import Scenario, run
from firstfix.sim.world import random_free_poses
from firstfix.system import localizer as module
from firstfix.system.inputs import NewMap, NoMotionUpdate, PoseHint, Reset
from firstfix.system.localizer import Localizer
from firstfix.system.outputs import Hypotheses, InitialPose, MotionRequest, Status, TrackedPose
from firstfix.system.transitions import State, after

HERE, THERE = SE2(4.0, 3.0, 1.0), SE2(7.5, 1.2, -2.0)
IN_A_ROOM = SE2(10.5, 1.2, 0.3)
BEHIND = SE2(2.5, 2.0, 0.0)  # in `two_rooms`, looking away from what differs
A_STEP, A_TURN = SE2(0.05, 0.0, 0.05), SE2(0.0, 0.0, 0.1)


def of(kind, outputs):
    return [output for output in outputs if isinstance(output, kind)]


def kinds(outputs):
    return [type(output) for output in outputs]


def reasons(outputs):
    return [status.reason for status in of(Status, outputs)]


def poses(outputs):
    return of((InitialPose, TrackedPose), outputs)


def is_at(pose, truth, metres=0.1, degrees=2.0):
    near = pose.distance_to(truth) <= metres
    return near and angle_error(pose.yaw, truth.yaw) <= math.radians(degrees)


def office_poses(office, n, seed):
    return random_free_poses(office, np.random.default_rng(seed), n, 0.4)


@pytest.fixture
def in_hall(robot_in, hall_plan):
    """A robot that has just been found in the hall."""
    robot = robot_in(hall_plan, HERE)
    assert kinds(robot.tick()) == [InitialPose, TrackedPose, Status]
    assert robot.localizer.state is State.LOCALIZED
    return robot


@pytest.fixture
def searches(monkeypatch):
    """Note the stamps of all scans that a whole map is searched for."""
    stamps, locate = [], Locator.locate

    def spy(self, scan):
        stamps.append(scan.stamp)
        return locate(self, scan)

    monkeypatch.setattr(Locator, "locate", spy)
    return stamps


# ---- found at once, and followed


@pytest.mark.parametrize("seed", range(4))
def test_the_first_scan_finds_the_robot_and_every_other_follows_it(robot_in, office, seed):
    robot = robot_in(office, office_poses(office, 1, seed)[0], seed=seed)
    for k in range(25):
        outputs = robot.tick(A_STEP if k else None)
        assert kinds(outputs) == ([InitialPose] if k == 0 else []) + [TrackedPose, Status]
        assert {output.stamp for output in outputs} == {robot.stamp}
        for found in poses(outputs):
            assert is_at(found.T_map_base, robot.pose)
            assert np.linalg.eigvalsh(found.covariance).min() > 0.0
        (tracked,) = of(TrackedPose, outputs)
        assert is_at(tracked.T_map_odom @ robot.T_odom_base, tracked.T_map_base, 1e-9, 1e-7)
        (status,) = of(Status, outputs)
        assert status.state is State.LOCALIZED
        assert status.evidence.explained > 0.9


def test_a_drive_with_drifting_wheels_is_followed(robot_in, driven, hall_plan):
    robot = robot_in(hall_plan, HERE)
    odometry = driven.odometry
    for scan, stamp, counted, truth in zip(
        driven.scans, odometry.stamps.tolist(), odometry.poses, driven.truth, strict=True
    ):
        robot.tell(Odometry(stamp, SE2.from_array(counted)))
        (tracked,) = of(TrackedPose, robot.tell(scan))
        assert is_at(tracked.T_map_base, SE2.from_array(truth), 0.1, 4.0)
    assert len(of(InitialPose, robot.said)) == 1


# ---- scans and odometry meet by their stamps


def test_a_scan_waits_until_odometry_reaches_it(in_hall):
    in_hall.tick()
    T_map_odom = of(TrackedPose, in_hall.said)[-1].T_map_odom
    in_hall.stamp += 0.1
    scan, T_odom_base = in_hall.scan(), in_hall.T_odom_base
    assert in_hall.tell(scan) == []
    assert in_hall.tell(Odometry(scan.stamp - 0.02, T_odom_base)) == []
    outputs = in_hall.tell(Odometry(scan.stamp + 0.02, T_odom_base @ SE2(0.2, 0.0, 0.0)))
    (tracked,) = of(TrackedPose, outputs)
    assert tracked.stamp == scan.stamp
    # Half the way: at the time of the scan, not of the message.
    expected = T_map_odom @ T_odom_base @ SE2(0.1, 0.0, 0.0)
    assert tracked.T_map_base.distance_to(expected) < 1e-6


def test_before_any_odometry_nothing_is_said(robot_in, hall_plan):
    robot = robot_in(hall_plan, HERE)
    assert robot.tell(robot.scan()) == []
    assert robot.localizer.state is State.SEARCHING


def test_of_the_scans_that_wait_the_newest_wins(in_hall):
    waiting = []
    for _ in range(3):
        in_hall.stamp += 0.1
        waiting.append(in_hall.scan())
        assert in_hall.tell(waiting[-1]) == []
    outputs = in_hall.tell(Odometry(in_hall.stamp, in_hall.T_odom_base))
    assert [tracked.stamp for tracked in of(TrackedPose, outputs)] == [waiting[-1].stamp]
    later = Odometry(in_hall.stamp + 1.0, in_hall.T_odom_base)
    assert in_hall.tell(later) == []  # the others are gone


def test_a_scan_older_than_all_odometry_is_left_out_and_that_is_said(in_hall):
    old = dataclasses.replace(in_hall.scan(), stamp=50.0)
    (status,) = in_hall.tell(old)
    assert "older" in status.reason
    assert "left out" in status.reason
    assert status.stamp == 50.0
    assert in_hall.localizer.state is State.LOCALIZED


# ---- several places


def test_twins_are_told_and_none_is_published(robot_in, three_rooms):
    robot = robot_in(three_rooms, IN_A_ROOM)
    outputs = robot.tick()
    assert kinds(outputs) == [Hypotheses, Status]  # no motion inside would help
    assert robot.localizer.state is State.TRACKING
    rooms = [place.pose.x - IN_A_ROOM.x for place in outputs[0].places if place.probability > 0.1]
    assert sorted(round(x) for x in rooms) == [-8, 0, 8]
    assert sum(place.probability for place in outputs[0].places) == pytest.approx(1.0, abs=0.05)
    robot.ticks(30)
    robot.ticks(120, A_TURN)
    assert poses(robot.said) == []
    (*_, last) = of(Hypotheses, robot.said)
    shares = [place.probability for place in last.places[:3]]
    assert min(shares) > 0.1
    assert sum(shares) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("room", [0.0, 7.0])
@pytest.mark.parametrize("seed", range(2))
def test_the_motion_that_is_asked_for_decides(robot_in, two_rooms, half_lidar, room, seed):
    robot = robot_in(two_rooms, SE2(room, 0.0, 0.0) @ BEHIND, lidar=half_lidar, seed=seed)
    outputs = robot.tick()
    assert kinds(outputs) == [Hypotheses, Status, MotionRequest]
    motion = outputs[-1]
    robot.ticks(10)
    assert poses(robot.said) == []
    robot.ticks(20, SE2(0.0, 0.0, motion.turn / 20))
    robot.ticks(20, SE2(motion.ahead / 20, 0.0, 0.0))
    robot.ticks(20, SE2(0.0, 0.0, motion.turn / 20))
    (found,) = of(InitialPose, robot.said)
    assert robot.localizer.state is State.LOCALIZED
    assert all(
        is_at(tracked.T_map_base, robot.pose) for tracked in of(TrackedPose, robot.said)[-1:]
    )
    assert abs(found.T_map_base.x - room - BEHIND.x) < 1.5


# ---- nothing fits


def test_a_foreign_building_is_told_once_a_second(robot_in, office, hall_plan, searches):
    for pose in office_poses(office, 4, 3):
        robot = robot_in(hall_plan, pose)
        robot.world = office
        robot.tick()
        if robot.localizer.state is State.SEARCHING:
            break
    else:
        raise AssertionError("no pose of the office is foreign to the hall")
    searches.clear()
    before = len(robot.said)
    robot.ticks(30)
    assert np.diff(searches).min() > 0.99
    assert len(searches) == 3
    assert kinds(robot.said[before:]) == [Status] * 3
    for status in of(Status, robot.said):
        assert status.state is State.SEARCHING
        assert "even at the best place only" in status.reason
        assert status.evidence.explained < 0.8
    # Who moves sees something else: that is worth a search of its own.
    searches.clear()
    robot.ticks(5, SE2(0.11, 0.0, 0.0))
    assert len(searches) == 5


# ---- lifted and carried away


@pytest.mark.parametrize("kind", [SignalKind.WHEEL_DROP, SignalKind.PICKED_UP, SignalKind.CLIFF])
def test_who_is_lifted_says_nothing_until_set_down_and_then_where(in_hall, kind):
    (status,) = in_hall.tell(Signal(in_hall.stamp, kind, active=True))
    assert status.state is State.SEARCHING
    assert kind.value in status.reason
    assert in_hall.localizer.particles is None
    in_hall.pose = THERE
    assert in_hall.ticks(20) == []
    assert in_hall.tell(Signal(in_hall.stamp, kind, active=False)) == []
    outputs = in_hall.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, THERE)


def test_a_robot_stands_when_the_last_of_its_sensors_says_so(in_hall):
    for kind in (SignalKind.CLIFF, SignalKind.WHEEL_DROP):
        in_hall.tell(Signal(in_hall.stamp, kind, active=True))
    in_hall.tell(Signal(in_hall.stamp, SignalKind.CLIFF, active=False))
    assert in_hall.ticks(3) == []
    in_hall.tell(Signal(in_hall.stamp, SignalKind.WHEEL_DROP, active=False))
    assert InitialPose in kinds(in_hall.tick())


def test_a_bumper_is_no_kidnapping(in_hall):
    for active in (True, False):
        assert in_hall.tell(Signal(in_hall.stamp, SignalKind.BUMPER, active=active)) == []
        assert kinds(in_hall.tick()) == [TrackedPose, Status]


def test_who_hangs_in_the_air_when_the_map_comes_is_not_searched(hall_plan, robot_in):
    robot = robot_in(hall_plan, HERE)
    robot.localizer = Localizer()
    robot.tell(Signal(99.0, SignalKind.WHEEL_DROP, active=True))
    robot.tell(NewMap(99.5, hall_plan))
    assert poses(robot.ticks(3)) == []


def test_a_scan_from_the_hands_is_not_used_after_the_robot_is_set_down(in_hall):
    in_hall.tell(Signal(in_hall.stamp, SignalKind.WHEEL_DROP, active=True))
    in_hall.stamp += 0.1
    assert in_hall.tell(in_hall.scan()) == []
    in_hall.tell(Signal(in_hall.stamp + 0.01, SignalKind.WHEEL_DROP, active=False))
    assert poses(in_hall.tell(Odometry(in_hall.stamp + 0.02, in_hall.T_odom_base))) == []


@pytest.mark.parametrize("seed", range(8))
def test_a_silent_kidnapping_is_noticed_and_no_wrong_pose_is_published(robot_in, office, seed):
    """Odometry is continuous, no signal: the scans alone tell."""
    start, goal = office_poses(office, 2, 100 + seed)
    assert start.distance_to(goal) > 1.0
    robot = robot_in(office, start, seed=seed)
    robot.ticks(4, A_STEP)
    robot.pose = goal
    outputs = robot.ticks(30, A_TURN)
    (found,) = of(InitialPose, outputs)
    assert found.stamp - outputs[0].stamp < 3.0
    moved = SE2(0.0, 0.0, 0.1 * round((found.stamp - 100.4) / 0.1))
    assert is_at(found.T_map_base, goal @ moved)
    later = [tracked for tracked in of(TrackedPose, outputs) if tracked.stamp >= found.stamp]
    assert all(tracked.T_map_base.distance_to(goal) < 0.1 for tracked in later)
    for status in of(Status, outputs):  # before that nobody claims that all is well
        if status.stamp < found.stamp:
            assert "doubtful" in status.reason


@pytest.mark.parametrize("seed", range(2))
def test_a_story_with_every_kind_of_kidnapping(maps_cache, office, seed):
    script = [Stand(0.3), DriveTo(seconds=3), Teleport(), Stand(0.5), CarryTo(seconds=1.0)]
    script += [DriveTo(seconds=3)]
    localizer = Localizer(cache_dir=maps_cache)
    localizer.handle(NewMap(0.0, office))
    found, disturbed = 0, 0
    for moment in run(Scenario(script), office, seed):
        disturbed += moment.disturbance is not None
        outputs = [output for event in moment.events for output in localizer.handle(event)]
        for pose in of(InitialPose, outputs):
            assert pose.stamp == moment.stamp
            assert is_at(pose.T_map_base, moment.T_map_base)
            found += 1
    assert disturbed == 2
    assert found == 3
    assert localizer.state is State.LOCALIZED


def test_a_small_slip_is_mended_without_a_search(robot_in, office, searches):
    for seed, pose in enumerate(office_poses(office, 4, 5)):
        robot = robot_in(office, pose, seed=seed)
        robot.tick()
        assert robot.localizer.state is State.LOCALIZED
        searches.clear()
        towards = 1.5 * seed
        robot.pose = pose @ SE2(
            0.5 * math.cos(towards), 0.5 * math.sin(towards), math.radians(20.0)
        )
        outputs = robot.ticks(10)
        assert searches == []
        (found,) = of(InitialPose, outputs)
        assert is_at(found.T_map_base, robot.pose)
        assert is_at(of(TrackedPose, outputs)[-1].T_map_base, robot.pose)


@pytest.mark.parametrize("metres", [0.15, 0.25])
def test_a_slip_too_small_for_a_doubt_is_mended_although_the_robot_stands(in_hall, metres):
    in_hall.pose = HERE @ SE2(metres, 0.0, math.radians(8.0))
    outputs = in_hall.ticks(30)
    assert is_at(of(TrackedPose, outputs)[-1].T_map_base, in_hall.pose, 0.1, 3.0)


# ---- people, and sensors that see nothing


@pytest.mark.parametrize("together", [True, False])
def test_people_are_no_kidnapping(robot_in, office, with_ranges, together):
    """A minute in which a third of the beams ends at somebody who is not in the map."""
    rng = np.random.default_rng(0)

    def crowd(scan):
        ranges = scan.ranges.astype(np.float64)
        n = len(ranges)
        hit = (rng.integers(n) + np.arange(54)) % n if together else rng.permutation(n)[:54]
        hit = hit[np.isfinite(ranges[hit])]
        ranges[hit] = rng.uniform(np.minimum(0.3, ranges[hit]), ranges[hit])
        return ranges

    robot = robot_in(office, office_poses(office, 1, 8)[0])
    robot.tick()
    for _ in range(600):
        outputs = robot.tick(None, with_ranges(crowd))
        assert kinds(outputs) == [TrackedPose, Status]
        assert is_at(outputs[0].T_map_base, robot.pose)
    assert robot.localizer.state is State.LOCALIZED


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, 0.15])
def test_a_blocked_sensor_leads_nowhere_wrong(in_hall, with_ranges, value):
    outputs = in_hall.ticks(60, None, with_ranges(lambda _: value))
    assert of(InitialPose, outputs) == []
    assert all(is_at(tracked.T_map_base, HERE) for tracked in of(TrackedPose, outputs))
    # When it is clear again the robot is found, at the latest when it moves on.
    in_hall.ticks(40, A_TURN)
    assert in_hall.localizer.state is State.LOCALIZED
    for pose in poses(in_hall.said):
        assert pose.T_map_base.distance_to(HERE) < 0.1


def test_a_hand_over_the_sensor_at_the_start_is_forgotten_when_it_is_gone(
    robot_in, office, with_ranges
):
    rng = np.random.default_rng(0)
    robot = robot_in(office, office_poses(office, 1, 1)[0])
    robot.ticks(5, None, with_ranges(lambda scan: rng.uniform(0.12, 0.3, len(scan))))
    assert poses(robot.said) == []
    robot.ticks(100)
    assert robot.localizer.state is State.LOCALIZED


# ---- odometry that begins anew


@pytest.mark.parametrize("restart", [SE2.identity(), SE2(100.0, -50.0, 3.0)])
def test_odometry_that_begins_anew_changes_no_pose(in_hall, restart):
    in_hall.ticks(10, A_STEP)
    in_hall.T_odom_base = restart
    outputs = in_hall.ticks(10, A_STEP)
    assert of(InitialPose, outputs) == []
    tracked = of(TrackedPose, outputs)
    assert len(tracked) == 10
    assert is_at(tracked[-1].T_map_base, in_hall.pose)
    expected = in_hall.pose @ in_hall.T_odom_base.inverse()
    assert is_at(tracked[-1].T_map_odom @ in_hall.T_odom_base, expected @ in_hall.T_odom_base)


def test_a_clock_that_goes_back_changes_no_pose(in_hall):
    in_hall.ticks(5, A_STEP)
    for k in range(5):
        stamp = 3.0 + 0.1 * k
        in_hall.tell(Odometry(stamp, in_hall.T_odom_base))
        outputs = in_hall.tell(dataclasses.replace(in_hall.scan(), stamp=stamp))
        assert kinds(outputs) == [TrackedPose, Status]
        assert outputs[0].stamp == stamp
        assert is_at(outputs[0].T_map_base, in_hall.pose)


# ---- maps, hints, requests


def test_without_a_map_nothing_is_done_and_that_is_said(hall_plan):
    localizer = Localizer()
    assert localizer.handle(Odometry(1.0, SE2.identity())) == []
    scan = Lidar(beams=60).scan(hall_plan, HERE, np.random.default_rng(0), 1.0)
    hint = PoseHint(1.0, HERE)
    for given in (scan, hint, Reset(1.0), NoMotionUpdate(1.0)):
        (status,) = localizer.handle(given)
        assert (status.stamp, status.state, status.reason) == (1.0, State.NO_MAP, "no map yet")
    assert localizer.particles is None


def test_a_new_map_ends_all_that_was(in_hall, office):
    in_hall.stamp += 0.1
    waiting = in_hall.scan()
    in_hall.tell(waiting)
    (status,) = in_hall.tell(NewMap(in_hall.stamp, office))
    assert status.state is State.SEARCHING
    assert in_hall.localizer.particles is None
    # What waited belongs to the floor before.
    assert in_hall.tell(Odometry(in_hall.stamp + 0.01, in_hall.T_odom_base)) == []
    (pose,) = office_poses(office, 1, 0)
    in_hall.world, in_hall.pose = office, pose
    outputs = in_hall.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, pose)


def test_a_map_that_cannot_be_searched_changes_nothing(in_hall):
    empty = OccupancyGrid(np.full((50, 50), FREE, np.int8), 0.05)
    with pytest.raises(MapError):
        in_hall.tell(NewMap(in_hall.stamp, empty))
    assert in_hall.localizer.state is State.LOCALIZED
    assert kinds(in_hall.tick()) == [TrackedPose, Status]


def foreign(robot_in, hall_plan, office):
    """A robot that has just found nothing, in the office with the map of the hall."""
    for pose in office_poses(office, 4, 3):
        robot = robot_in(hall_plan, pose)
        robot.world = office
        robot.tick()
        if robot.localizer.state is State.SEARCHING:
            return robot
    raise AssertionError("no pose of the office is foreign to the hall")


@pytest.mark.parametrize("told", ["map", "reset", "lifted", "update"])
def test_after_news_the_next_scan_is_searched_at_once(robot_in, hall_plan, office, told):
    robot = foreign(robot_in, hall_plan, office)
    if told == "map":
        robot.tell(NewMap(robot.stamp, office))
    elif told == "reset":
        robot.tell(Reset(robot.stamp))
    elif told == "lifted":
        for active in (True, False):
            robot.tell(Signal(robot.stamp, SignalKind.PICKED_UP, active=active))
    else:
        robot.tell(NoMotionUpdate(robot.stamp))
    assert robot.tick() != []


def test_a_reset_forgets_and_searches(in_hall):
    (status,) = in_hall.tell(Reset(in_hall.stamp))
    assert status.state is State.SEARCHING
    assert in_hall.localizer.particles is None
    assert kinds(in_hall.tick()) == [InitialPose, TrackedPose, Status]


def test_an_update_can_be_asked_for_at_rest(in_hall):
    in_hall.tick()
    before = in_hall.localizer.particles
    in_hall.tick()
    assert in_hall.localizer.particles is before
    (status,) = in_hall.tell(NoMotionUpdate(in_hall.stamp))
    assert status.state is State.LOCALIZED
    in_hall.tick()
    once = in_hall.localizer.particles
    assert once is not before
    in_hall.tick()
    assert in_hall.localizer.particles is once  # one scan was asked for


def test_a_right_hint_decides_between_twins(robot_in, three_rooms):
    """What no scan can tell, a person can."""
    robot = robot_in(three_rooms, IN_A_ROOM)
    robot.tick()
    robot.tell(PoseHint(robot.stamp, IN_A_ROOM @ SE2(0.4, -0.3, 0.3)))
    outputs = robot.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, IN_A_ROOM)
    robot.ticks(20, A_TURN)
    assert robot.localizer.state is State.LOCALIZED


def test_a_hint_may_come_before_odometry(robot_in, hall_plan):
    robot = robot_in(hall_plan, HERE)
    (status,) = robot.tell(PoseHint(robot.stamp, HERE @ SE2(0.3, 0.3, 0.3)))
    assert status.state is State.TRACKING
    outputs = robot.tick()
    assert is_at(of(InitialPose, outputs)[0].T_map_base, HERE)


@pytest.mark.parametrize("hint", [SE2(1.0, 2.0, 2.0), SE2(8.0, 6.0, 0.0), SE2(900.0, 0.0, 0.0)])
def test_a_wrong_hint_costs_one_scan(in_hall, hint):
    in_hall.tell(PoseHint(in_hall.stamp, hint))
    (status,) = in_hall.tick()
    assert status.state is State.SEARCHING
    assert "fits elsewhere, or nowhere" in status.reason
    outputs = in_hall.tick()
    assert kinds(outputs) == [InitialPose, TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, HERE)


@pytest.mark.parametrize(
    ("truth", "hint"),
    [
        (SE2(7.03, 12.35, -0.30), SE2(33.40, 11.91, 2.20)),
        (SE2(17.41, 6.91, -1.50), SE2(13.60, 3.87, 1.33)),
        (SE2(35.08, 12.34, -3.09), SE2(21.86, 11.52, -2.33)),
    ],
)
def test_a_wrong_hint_is_not_followed_where_the_scan_is_sure_of_another_place(
    robot_in, office, truth, hint
):
    """About three quarters of the beams fit near the hint; all of them fit elsewhere."""
    robot = robot_in(office, truth)
    assert is_at(of(InitialPose, robot.tick())[0].T_map_base, truth)  # UNIQUE
    robot.tell(PoseHint(robot.stamp, hint))
    for pose in poses(robot.ticks(2)):
        assert is_at(pose.T_map_base, truth)


# ---- laws


def told_by(localizer, story):
    return [output for given in story for output in localizer.handle(given)]


@pytest.fixture(scope="module")
def story(office):
    """Inputs of a drive with a teleport and a lift."""
    script = [Stand(0.3), DriveTo(seconds=2), Teleport(), Stand(0.5), CarryTo(seconds=0.5)]
    script += [Stand(0.3)]
    moments = list(run(Scenario(script), office, 3))
    story = [NewMap(0.0, office), *(event for moment in moments for event in moment.events)]
    story += [Reset(moments[-1].stamp + 0.09), *moments[-1].events]
    return story


def bits(value):
    """Turn a value into something that equals only itself, bit for bit."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if dataclasses.is_dataclass(value):
        fields = dataclasses.fields(value)
        return type(value), *(bits(getattr(value, field.name)) for field in fields)
    if isinstance(value, (tuple, list)):
        return tuple(bits(part) for part in value)
    return value.hex() if isinstance(value, float) else value


def test_the_same_inputs_give_the_same_outputs(maps_cache, story):
    first, second = (told_by(Localizer(cache_dir=maps_cache), story) for _ in range(2))
    assert len(of(InitialPose, first)) >= 3
    assert bits(first) == bits(second)


def test_what_was_said_stays_said(maps_cache, story):
    """No output is changed afterwards, and no input ever."""
    given = [event for event in story if isinstance(event, LaserScan)]
    before = [scan.ranges.tobytes() for scan in given]
    localizer, said, copies = Localizer(cache_dir=maps_cache), [], []
    for event in story:
        outputs = localizer.handle(event)
        said += outputs
        copies += copy.deepcopy(outputs)
    assert bits(said) == bits(copies)
    assert [scan.ranges.tobytes() for scan in given] == before


def test_only_the_table_changes_states(maps_cache, story, monkeypatch):
    steps = []

    def spy(state, event):
        steps.append((state, after(state, event)))
        return steps[-1][1]

    monkeypatch.setattr(module, "after", spy)
    localizer, state = Localizer(cache_dir=maps_cache), State.NO_MAP
    for event in story:
        outputs = localizer.handle(event)
        for before, now in steps:
            assert before is state
            state = now
        steps.clear()
        assert localizer.state is state
        for status in of(Status, outputs):
            assert status.state is state
        assert not poses(outputs) or state is State.LOCALIZED
    assert state is State.LOCALIZED


def test_move_map_and_robot_together_and_nothing_else_changes(robot_in, hall_plan):
    by = SE2(-20.0, 7.0, 2.2)
    moved = OccupancyGrid(hall_plan.cells, hall_plan.resolution, by @ hall_plan.T_map_grid)
    here, there = robot_in(hall_plan, HERE), robot_in(moved, by @ HERE)
    for robot in (here, there):
        robot.ticks(4, A_STEP)
    a, b = poses(here.said), poses(there.said)
    assert kinds(here.said) == kinds(there.said)
    for one, other in zip(a, b, strict=True):
        assert (by @ one.T_map_base).distance_to(other.T_map_base) < 0.1


# ---- nonsense


@pytest.mark.parametrize("beams", [1, 7, 8])
@pytest.mark.parametrize("value", [1.0, math.nan, math.inf, -math.inf, -1.0, 1e30])
def test_scans_that_say_next_to_nothing_do_no_harm(robot_in, hall_plan, beams, value):
    robot = robot_in(hall_plan, HERE)
    ranges = np.full(beams, value, np.float32)
    for k in range(5):
        robot.tell(Odometry(float(k), SE2.identity()))
        robot.tell(LaserScan(ranges, 0.0, 0.5, 0.1, 12.0, stamp=float(k)))
    assert poses(robot.said) == []
    outputs = robot.ticks(30, A_TURN)  # and they are forgotten
    assert robot.localizer.state is State.LOCALIZED
    assert is_at(of(TrackedPose, outputs)[-1].T_map_base, robot.pose)


def test_stamps_that_go_back_and_forth_do_no_harm(in_hall):
    rng = np.random.default_rng(0)
    for stamp in rng.uniform(-1e9, 1e9, 30).tolist():
        in_hall.tell(Odometry(stamp, in_hall.T_odom_base))
        in_hall.tell(dataclasses.replace(in_hall.scan(), stamp=stamp + rng.uniform(-1.0, 1.0)))
    assert all(is_at(pose.T_map_base, HERE) for pose in poses(in_hall.said))


@pytest.mark.parametrize("stamp", [-1e300, 1e18, 1e300])
def test_huge_stamps_do_no_harm(in_hall, stamp):
    in_hall.tell(Odometry(stamp, in_hall.T_odom_base))
    outputs = in_hall.tell(dataclasses.replace(in_hall.scan(), stamp=stamp))
    assert kinds(outputs) == [TrackedPose, Status]
    assert is_at(outputs[0].T_map_base, HERE)


def test_odometry_at_the_end_of_the_world_does_no_harm(in_hall):
    in_hall.T_odom_base = SE2(1e12, -1e12, 1.0)
    in_hall.ticks(5)
    in_hall.T_odom_base = SE2.identity()
    assert is_at(poses(in_hall.ticks(5))[-1].T_map_base, HERE)


def test_signals_without_end_do_no_harm(in_hall):
    for k in range(500):
        in_hall.tell(Signal(in_hall.stamp + 1e-4 * k, SignalKind.CLIFF, active=True))
    assert in_hall.ticks(2) == []
    in_hall.tell(Signal(in_hall.stamp, SignalKind.CLIFF, active=False))
    assert InitialPose in kinds(in_hall.tick())
