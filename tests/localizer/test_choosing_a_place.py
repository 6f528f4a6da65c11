"""A person chooses one of several places: stable numbers, refused choices, and the status."""

from __future__ import annotations

import pytest

from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import PoseHint, Reset
from firstfix.localizer.outputs import Hypotheses, InitialPose, Status
from firstfix.localizer.states import State

IN_A_ROOM = SE2(10.5, 1.2, 0.3)
BEHIND = SE2(2.5, 2.0, 0.0)  # in `two_rooms`, facing away from the shelf that differs
A_TURN = SE2(0.0, 0.0, 0.1)


@pytest.fixture
def resting(robot_in, three_rooms):
    """A robot that has rested in one of three equal rooms for ten seconds."""
    robot = robot_in(three_rooms, IN_A_ROOM)
    robot.ticks(100)
    return robot


def room_of(place):
    return round((place.pose.x - IN_A_ROOM.x) / 8.0)


def choose(robot, place):
    return robot.send(PoseHint(robot.stamp, place.pose, hypothesis_id=place.id))


def test_at_rest_places_keep_number_and_rank(resting, of):
    resting.ticks(200)
    lists = of(Hypotheses, resting.outputs)
    assert len(lists) >= 29
    assert len({tuple(place.id for place in output.places) for output in lists}) == 1


def test_numbers_are_different_and_follow_the_place_when_the_robot_turns(resting, of):
    resting.ticks(60, A_TURN)
    rooms = {}
    for output in of(Hypotheses, resting.outputs):
        assert len({place.id for place in output.places}) == len(output.places)
        for place in output.places[:3]:
            rooms.setdefault(place.id, set()).add(room_of(place))
    likely = {place.id for place in output.places[:3]}
    assert all(len(rooms[number]) == 1 for number in likely)


@pytest.mark.parametrize("rank", range(3))
def test_the_place_that_is_chosen_is_published_wherever_it_ranks(resting, of, rank):
    place = of(Hypotheses, resting.outputs)[0].places[rank]
    resting.ticks(60, A_TURN)
    choose(resting, place)
    assert resting.localizer.state is State.VERIFYING_HINT
    (found,) = of(InitialPose, resting.tick())
    assert room_of(place) == round((found.T_map_base.x - IN_A_ROOM.x) / 8.0)


def test_a_place_that_is_gone_is_refused_in_one_sentence(resting, of):
    place = of(Hypotheses, resting.outputs)[-1].places[0]
    resting.send(Reset(resting.stamp))
    resting.tick()
    state = resting.localizer.state
    (status,) = choose(resting, place)
    assert status.reason == f"place {place.id} is no longer listed: choose another one"
    assert status.state is resting.localizer.state is state


def test_the_status_of_a_chosen_place_has_the_source_and_the_rivals(resting, of):
    last = of(Status, resting.outputs)[-1]
    assert (last.rivals, last.chosen_by) == (3, None)
    choose(resting, of(Hypotheses, resting.outputs)[-1].places[1])
    for outputs in (resting.tick(), resting.tick(), resting.ticks(60, A_TURN)):
        status = of(Status, outputs)[-1]
        assert status.state is State.LOCALIZED
        assert (status.rivals, status.chosen_by) == (3, "a person")
        assert status.reason == "chosen by a person; 3 places fit equally well"


def test_a_pose_that_one_scan_decides_has_no_chooser(in_hall, of):
    in_hall.send(PoseHint(in_hall.stamp, in_hall.pose))
    (status,) = of(Status, in_hall.tick())
    assert (status.rivals, status.chosen_by) == (1, None)


@pytest.mark.parametrize("chosen_room", [0.0, 7.0])
def test_evidence_decides_for_or_against_the_choice(
    robot_in, two_rooms, half_lidar, of, is_at, chosen_room
):
    robot = robot_in(two_rooms, SE2(7.0, 0.0, 0.0) @ BEHIND, lidar=half_lidar)
    robot.tick()
    robot.send(PoseHint(robot.stamp, SE2(chosen_room, 0.0, 0.0) @ BEHIND, "the saved pose"))
    (status,) = of(Status, robot.tick())
    assert status.chosen_by == "the saved pose"
    assert status.rivals == 2
    robot.ticks(63, A_TURN)
    status = of(Status, robot.outputs)[-1]
    assert (status.state, status.rivals, status.chosen_by) == (State.LOCALIZED, 1, None)
    assert is_at(robot.outputs[-2].T_map_base, robot.pose, 0.3, 3.0)
