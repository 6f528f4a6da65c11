"""Laws for any sequence of inputs: reproducible, outputs immutable, states by the table."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Stand, Teleport
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.localizer import map_localization as module
from firstfix.localizer.inputs import NewMap, Reset
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Status
from firstfix.localizer.states import State, next_state

HERE = SE2(4.0, 3.0, 1.0)  # where `in_hall` stands
A_STEP = SE2(0.05, 0.0, 0.05)


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


def test_the_same_inputs_give_the_same_outputs(maps_cache, story, of):
    first, second = (told_by(Localizer(cache_dir=maps_cache), story) for _ in range(2))
    assert len(of(InitialPose, first)) >= 3
    assert bits(first) == bits(second)


def test_outputs_do_not_change_later(maps_cache, story):
    """No output is changed afterwards, and no input ever."""
    given = [event for event in story if isinstance(event, LaserScan)]
    before = [scan.ranges.tobytes() for scan in given]
    localizer, reported, copies = Localizer(cache_dir=maps_cache), [], []
    for event in story:
        outputs = localizer.handle(event)
        reported += outputs
        copies += copy.deepcopy(outputs)
    assert bits(reported) == bits(copies)
    assert [scan.ranges.tobytes() for scan in given] == before


def test_only_the_table_changes_states(maps_cache, story, monkeypatch, of, poses):
    steps = []

    def spy(state, event):
        steps.append((state, next_state(state, event)))
        return steps[-1][1]

    monkeypatch.setattr(module, "next_state", spy)
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


def test_move_map_and_robot_together_and_nothing_else_changes(robot_in, hall_plan, kinds, poses):
    by = SE2(-20.0, 7.0, 2.2)
    moved = OccupancyGrid(hall_plan.cells, hall_plan.resolution, by @ hall_plan.T_map_grid)
    here, there = robot_in(hall_plan, HERE), robot_in(moved, by @ HERE)
    for robot in (here, there):
        robot.ticks(4, A_STEP)
    a, b = poses(here.outputs), poses(there.outputs)
    assert kinds(here.outputs) == kinds(there.outputs)
    for one, other in zip(a, b, strict=True):
        assert (by @ one.T_map_base).distance_to(other.T_map_base) < 0.1
