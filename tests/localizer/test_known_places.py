"""Fixes, priors of a search, and hints with a radius, on a running localizer."""

import numpy as np
import pytest

from firstfix.belief.prior import Near, Region
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import PoseHint, PositionFix, Reset
from firstfix.localizer.outputs import Hypotheses, InitialPose, Status
from firstfix.localizer.states import State

COVARIANCE = np.diag([0.04, 0.04, 0.03])


def of(kind, outputs):
    return [output for output in outputs if isinstance(output, kind)]


@pytest.fixture
def in_rooms(robot_in, three_rooms):
    """A robot in the second of three rooms that look alike."""
    return robot_in(three_rooms, SE2(10.0, 2.0, 0.4))


def test_a_fix_orders_places_that_look_alike_and_decides_nothing(in_rooms):
    in_rooms.tick()
    in_rooms.send(PositionFix(in_rooms.stamp, in_rooms.pose, COVARIANCE, "a marker"))
    outputs = in_rooms.ticks(15)
    (*_, listed) = of(Hypotheses, outputs)
    assert listed.places[0].pose.distance_to(in_rooms.pose) < 0.1
    assert listed.places[0].probability > 0.95
    assert of(InitialPose, outputs) == []  # another marker may look like it


def test_the_newest_fix_of_a_source_replaces_the_one_before(in_rooms):
    in_rooms.tick()
    for x in (2.0, 10.0):
        at = SE2(x, 2.0, 0.4)
        in_rooms.send(PositionFix(in_rooms.stamp, at, COVARIANCE, "a marker"))
    assert len(in_rooms.localizer.belief.hints) == 1
    (*_, listed) = of(Hypotheses, in_rooms.ticks(15))
    assert listed.places[0].pose.distance_to(in_rooms.pose) < 0.1


def test_a_right_fix_agrees_and_a_wrong_one_is_overruled(robot_in, hall_plan):
    for fix in (SE2(4.0, 3.0, 1.0), SE2(8.0, 6.0, -2.0)):
        robot = robot_in(hall_plan, SE2(4.0, 3.0, 1.0))
        robot.send(PositionFix(robot.stamp, fix, COVARIANCE))
        robot.ticks(3, SE2(0.2, 0.0, 0.0))
        found = of(InitialPose, robot.outputs)
        assert all(pose.T_map_base.distance_to(robot.pose) < 1.0 for pose in found)


@pytest.mark.parametrize(
    ("pose", "covariance"),
    [
        (SE2(500.0, 0.0, 0.0), COVARIANCE),
        (SE2(4.0, 3.0, 0.0), np.diag([-1.0, 1.0, 1.0])),
        (SE2(4.0, 3.0, 0.0), np.full((3, 3), np.nan)),
    ],
)
def test_a_fix_that_cannot_be_used_is_refused_in_one_sentence(in_hall, pose, covariance):
    (status,) = in_hall.send(PositionFix(in_hall.stamp, pose, covariance, "a marker"))
    assert status.reason.startswith("a marker refused: ")
    assert status.state is State.LOCALIZED
    assert in_hall.tick()


def test_a_search_may_begin_with_a_prior(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(4.0, 3.0, 1.0))
    robot.send(Reset(robot.stamp, Near(SE2(4.0, 3.0, 1.0), 2.0)))
    robot.tick()
    assert robot.localizer.state is State.LOCALIZED


def test_a_zone_outside_the_map_is_refused_and_the_search_goes_on(robot_in, hall_plan):
    robot = robot_in(hall_plan, SE2(4.0, 3.0, 1.0))
    far = Region([(900.0, 0.0), (901.0, 0.0), (901.0, 2.0)])
    (status,) = robot.send(Reset(robot.stamp, far))
    assert status.reason.startswith("prior refused: ")
    robot.tick()
    assert robot.localizer.state is State.LOCALIZED


def test_a_hint_has_the_radius_that_it_states(in_rooms):
    """As SICK's LocInitializeAtPose: a pose and a search radius; it chooses among equal rooms."""
    off = in_rooms.pose @ SE2(1.5, 0.5, 0.0)
    for radius, is_found in ((0.3, False), (2.5, True)):
        in_rooms.send(PoseHint(in_rooms.stamp, off, "the operator", radius=radius))
        in_rooms.ticks(2)
        assert (in_rooms.localizer.state is State.LOCALIZED) == is_found
    (*_, status) = of(Status, in_rooms.outputs)
    assert status.chosen_by == "the operator"
