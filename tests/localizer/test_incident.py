"""The last seconds of a localizer, repeated to the last bit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.localizer.checkpoint import _PARTS, _REBUILT
from firstfix.localizer.incident import Cause, Incident, IncidentRecorder
from firstfix.localizer.incident_document import (
    from_document,
    localizer_at_start,
    repeat,
    to_document,
)
from firstfix.localizer.inputs import NewMap, NoMotionUpdate, PoseHint, PositionFix, Reset
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.states import State

STEP = SE2(0.05, 0.0, 0.04)


@pytest.fixture
def recorded(hall_plan, robot_in):
    """Give a robot in the hall whose localizer is recorded, and the causes so far."""
    return _Recorded(robot_in(hall_plan, SE2(3.0, 2.5, 0.4)), 3.0)


class _Recorded:
    def __init__(self, robot, seconds: float) -> None:
        self.robot, self.causes = robot, []
        self.recorder = IncidentRecorder(seconds)
        handle = robot.localizer.handle

        def send(given):
            outputs = handle(given)
            cause = self.recorder.observe(given, outputs, robot.localizer)
            if cause is not None:
                self.causes.append(cause)
            return outputs

        robot.send = send
        send(NewMap(99.5, robot.world))

    def take(self) -> Incident:
        incident = self.recorder.take(Cause.REQUESTED, "a test")
        assert incident is not None
        return incident


def through_json(incident: Incident) -> tuple[dict, dict]:
    document, arrays = to_document(incident)
    return json.loads(json.dumps(document)), arrays


def assert_identical(incident: Incident, cache: Path) -> None:
    saved = from_document(*through_json(incident))
    steps = list(
        repeat(saved.incident, localizer_at_start(saved.incident, saved.incident.map, cache))
    )
    assert len(steps) == len(incident.inputs)
    assert [step.is_identical for step in steps] == [True] * len(steps)
    assert saved.other_software == ""


def test_a_kidnapped_robot_is_repeated_to_the_last_bit(recorded, maps_cache):
    robot = recorded.robot
    robot.ticks(35, STEP)
    robot.pose = SE2(7.5, 5.0, -1.5)
    robot.ticks(8, STEP)
    assert Cause.REVOKED_POSE in recorded.causes
    incident = recorded.take()
    assert robot.localizer.state is State.LOCALIZED
    # It begins in the middle of the drive, with particles, views and random numbers of then.
    assert incident.inputs[0].stamp > 100.3
    assert 3.0 <= incident.stamp - incident.inputs[0].stamp < 4.3
    assert_identical(incident, maps_cache)


def test_hints_fixes_resets_and_a_lost_pose_are_repeated(recorded, maps_cache, with_ranges):
    robot = recorded.robot
    robot.ticks(3)
    robot.send(PositionFix(robot.stamp, robot.pose, np.diag([0.1, 0.1, 0.1]), "the dock"))
    robot.send(NoMotionUpdate(robot.stamp))
    robot.ticks(4, STEP)
    robot.send(PoseHint(robot.stamp, SE2(7.5, 5.0, -1.5)))
    robot.ticks(2)
    assert recorded.causes == [Cause.REFUSED_HINT]
    robot.send(Reset(robot.stamp))
    robot.ticks(2)
    robot.ticks(25, damage=with_ranges(lambda scan: 2.0 + np.sin(np.arange(180.0) * scan.stamp)))
    assert recorded.causes[-1] is Cause.LOST_POSE
    assert_identical(recorded.take(), maps_cache)


def test_several_places_that_look_alike_are_repeated(three_rooms, robot_in, maps_cache):
    recorded = _Recorded(robot_in(three_rooms, SE2(2.0, 2.0, 0.4)), 0.9)
    recorded.robot.ticks(18, SE2(0.03, 0.0, 0.05))
    assert recorded.robot.localizer.state is State.DISAMBIGUATING
    assert_identical(recorded.take(), maps_cache)


def test_known_changes_are_saved_with_the_map(recorded):
    world = recorded.robot.world
    gone = OccupancyGrid(np.zeros_like(world.cells), world.resolution, world.T_map_grid)
    recorded.robot.send(NewMap(recorded.robot.stamp, world.with_changes(gone)))
    recorded.robot.ticks(1)
    saved = from_document(*through_json(recorded.take()))
    assert (saved.incident.map.grid.changed == world.occupied).all()


def test_a_flipped_bit_in_an_output_is_noticed(recorded, maps_cache):
    recorded.robot.ticks(5)
    document, arrays = through_json(recorded.take())
    arrays = dict(arrays, arrays=arrays["arrays"].copy())
    arrays["arrays"][-1] ^= 1  # of the last covariance
    saved = from_document(document, arrays)
    steps = repeat(
        saved.incident, localizer_at_start(saved.incident, saved.incident.map, maps_cache)
    )
    assert not all(step.is_identical for step in steps)


def test_memory_is_bounded_in_time(recorded):
    recorded.robot.ticks(120)
    assert len(recorded.take().inputs) <= 2 * 10 * 4 + 2


def test_a_new_map_and_a_new_localizer_begin_anew(recorded, hall_plan, maps_cache):
    recorded.robot.ticks(3)
    recorded.robot.send(NewMap(200.0, hall_plan))
    assert recorded.take().inputs == ()
    other = Localizer(cache_dir=maps_cache)
    known = NewMap(201.0, hall_plan)
    recorded.recorder.observe(known, other.handle(known), other)
    assert recorded.take().map is known


def test_what_somebody_asked_for_is_no_incident(recorded):
    recorded.robot.ticks(3)
    recorded.robot.send(Reset(recorded.robot.stamp))
    recorded.robot.ticks(2)
    assert recorded.causes == []


def test_there_is_nothing_before_the_first_map():
    recorder, localizer = IncidentRecorder(3.0), Localizer()
    given = Reset(0.0)
    recorder.observe(given, localizer.handle(given), localizer)
    assert recorder.take(Cause.REQUESTED, "") is None


def test_every_attribute_of_a_localizer_is_state_or_made_anew(recorded):
    """A new attribute must be added to the checkpoint, or repeating would differ."""
    recorded.robot.ticks(3)
    found = [recorded.robot.localizer]
    for part in found:
        state = _PARTS[type(part)]
        assert set(vars(part)) == set(state) | _REBUILT.get(type(part), frozenset())
        found += [getattr(part, name) for name, kind in state.items() if kind in _PARTS]
    assert {type(part) for part in found} == set(_PARTS)


def test_another_map_is_refused(recorded, hall_plan):
    recorded.robot.ticks(2)
    document, arrays = through_json(recorded.take())
    other = OccupancyGrid(hall_plan.cells[1:].copy(), hall_plan.resolution)
    with pytest.raises(InputError, match="not the map of the incident"):
        from_document(document, arrays, other)
    del arrays["cells"]
    with pytest.raises(InputError, match="Pass its YAML with --map"):
        from_document(document, arrays)
    assert from_document(document, arrays, hall_plan).incident.map.grid is hall_plan


def _places(value, path=()):
    """Yield the path of every value of a document."""
    yield path
    if isinstance(value, (dict, list)):
        for key, child in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _places(child, (*path, key))


def test_hostile_documents_end_in_one_sentence(recorded, maps_cache):
    """Any value is replaced by others: nothing but InputError, or an incident that runs."""
    recorded.robot.ticks(2)
    document, arrays = through_json(recorded.take())
    text, rng = json.dumps(document), np.random.default_rng(4)
    paths = [path for path in _places(document) if path]
    evil = [None, -1, 1e300, "x" * 50, [], {}, {"node": 10**9}, {"node": -1}, True, {"tuple": 3}]
    evil += [{"known": "fields"}, {"enum": ["State", "X"]}, {"deque": [-5, []]}, [[]], 2**70]
    said = []
    for i in rng.choice(len(paths), 150):
        copy = json.loads(text)
        *way, last = paths[i]
        parent = copy
        for key in way:
            parent = parent[key]
        parent[last] = evil[rng.integers(len(evil))]
        try:
            saved = from_document(copy, arrays)
            if saved.incident.config == recorded.robot.localizer.config:
                list(
                    repeat(
                        saved.incident,
                        localizer_at_start(saved.incident, saved.incident.map, maps_cache),
                    )
                )
        except InputError as error:
            said.append(str(error))
    assert len(said) > 75
    assert max(map(len, said)) < 400


def test_a_small_file_does_not_unfold_to_a_huge_one(recorded):
    recorded.robot.ticks(1)
    document, arrays = through_json(recorded.take())
    start = len(document["nodes"])
    document["nodes"].append(["Near", {"pose": _identity(document), "radius": 1.0, "angle": 1.0}])
    for i in range(40):
        twice = {"tuple": [{"node": start + i}, {"node": start + i}]}
        document["nodes"].append(["All", {"priors": twice}])
    with pytest.raises(InputError, match="too many parts"):
        from_document(document, arrays)


def _identity(document) -> dict:
    poses = (i for i, node in enumerate(document["nodes"]) if node[0] == "SE2")
    return {"node": next(poses)}
