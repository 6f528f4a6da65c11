"""Commands of viewers reach the localizer or the simulated robot, or are refused with a reason."""

from __future__ import annotations

from typing import Any

import pytest
from live_lab import drive

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import Input, PoseHint, Reset
from firstfix.localizer.outputs import Hypotheses, MotionRequest
from firstfix.localizer.states import State
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.commands import (
    Carry,
    Command,
    CoverSensor,
    Decide,
    DriveTo,
    Kidnap,
    Pause,
    PickPlace,
    Relocalize,
    RunAmcl,
    SelectSensor,
    SelectWorld,
    SetPeople,
    SetPose,
)
from firstfix.web.snapshot import AmclStart, SimulationStatus


class Recorder:
    """A simulated robot that records what it is asked to do."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []

    status = SimulationStatus("house", "360° x 12 m")
    worlds, sensors = ("house", "office"), ("360° x 12 m",)

    def kidnap(self) -> SE2:
        self.calls.append(("kidnap",))
        return SE2(1.0, 2.0, 0.0)

    def cover_sensor(self, *, covered: bool) -> None:
        self.calls.append(("cover_sensor", covered))

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments: self.calls.append((name, *arguments))


@pytest.fixture
def ambiguous():
    """A robot in one of four equal rooms, after its first scan."""
    begun = drive("rooms")
    begun.step(21)
    assert begun.store.snapshot.state is State.DISAMBIGUATING
    return begun


def test_hints_and_resets_have_the_time_of_the_snapshot(ambiguous):
    given: list[Input] = []
    executor = CommandExecutor(ambiguous.store, given.append)
    executor.execute(SetPose(1.0, 2.0, 3.0))
    executor.execute(Relocalize())
    hint, reset = given
    assert isinstance(hint, PoseHint)
    assert isinstance(reset, Reset)
    assert hint.T_map_base == SE2(1.0, 2.0, 3.0)
    assert hint.stamp == reset.stamp == ambiguous.store.snapshot.stamp


def test_a_new_ranking_between_display_and_click_picks_the_place_that_was_clicked(ambiguous):
    begun = ambiguous
    shown = begun.store.snapshot.hypotheses
    clicked = shown[2]
    places = (*shown[1:], shown[0])  # the list is ranked anew before the click arrives
    begun.store(Reset(0.0), [Hypotheses(begun.store.snapshot.stamp, places)], begun.localizer)
    assert begun.store.snapshot.hypotheses[2].id != clicked.id
    CommandExecutor(begun.store, begun.give).execute(PickPlace(clicked.id))
    begun.step(1)
    snapshot = begun.store.snapshot
    assert snapshot.state is State.LOCALIZED
    assert snapshot.pose.distance_to(clicked.pose) < 0.3
    assert (snapshot.chosen_by, snapshot.rivals) == ("a person", 4)


def test_a_place_that_is_no_longer_listed_is_refused(ambiguous):
    given: list[Input] = []
    executor = CommandExecutor(ambiguous.store, given.append)
    gone = 1 + max(place.id for place in ambiguous.store.snapshot.hypotheses)
    with pytest.raises(InputError, match="no longer in the list"):
        executor.execute(PickPlace(gone))
    assert given == []


@pytest.mark.parametrize(
    ("command", "call"),
    [
        (Pause(True), ("pause",)),
        (Pause(False), ("resume",)),
        (DriveTo(1.0, 2.0), ("drive_to", 1.0, 2.0)),
        (Carry(1.0, 2.0, 3.0), ("carry_to", SE2(1.0, 2.0, 3.0))),
        (SetPeople(4), ("set_people", 4)),
        (Kidnap(), ("kidnap",)),
        (CoverSensor(True), ("cover_sensor", True)),
        (SelectSensor("60° x 5 m"), ("select_sensor", "60° x 5 m")),
        (SelectWorld("office"), ("select_world", "office")),
        (RunAmcl(AmclStart.POSE), ("run_amcl", AmclStart.POSE)),
    ],
)
def test_commands_of_the_simulation(ambiguous, command: Command, call: tuple[Any, ...]):
    robot = Recorder()
    CommandExecutor(ambiguous.store, lambda _: None, robot).execute(command)
    assert robot.calls == [call]
    assert ambiguous.store.events()[-1].kind == "person"


@pytest.mark.parametrize(
    ("command", "remedy"),
    [(DriveTo(1.0, 2.0), "Use your navigation stack"), (Pause(True), "simulated robot")],
)
def test_a_real_robot_is_not_controlled(ambiguous, command: Command, remedy: str):
    with pytest.raises(InputError, match=remedy):
        CommandExecutor(ambiguous.store, lambda _: None).execute(command)


def test_the_deciding_motion_is_executed_while_there_is_one(ambiguous):
    store, robot = ambiguous.store, Recorder()
    executor = CommandExecutor(store, lambda _: None, robot)
    store(Reset(0.0), [MotionRequest(3.0, 0.5, 2.0, 0.4)], ambiguous.localizer)
    executor.execute(Decide())
    assert robot.calls == [("move", 0.5, 2.0)]
    ambiguous.give(Reset(store.snapshot.stamp))
    with pytest.raises(InputError, match="no deciding motion"):
        executor.execute(Decide())


def test_the_menus_and_the_status_of_a_simulation_are_shown(ambiguous):
    robot = Recorder()
    executor = CommandExecutor(ambiguous.store, lambda _: None, robot)
    assert (executor.menus.worlds, executor.menus.sensors) == (robot.worlds, robot.sensors)
    assert ambiguous.store.snapshot.simulation == robot.status
    assert CommandExecutor(ambiguous.store, lambda _: None).menus is None
