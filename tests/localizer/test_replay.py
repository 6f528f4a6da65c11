"""A log becomes inputs: everything once, in the order of time, whenever it is played."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.odometry import Odometry
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, TrackedPose
from firstfix.localizer.replay import recorded_inputs, replay
from firstfix.localizer.states import State

times = st.lists(st.integers(0, 20).map(float), min_size=1, max_size=20).map(sorted)


def scan_at(stamp: float) -> LaserScan:
    return LaserScan(np.ones(3, np.float32), 0.0, 0.1, 0.1, 5.0, stamp=stamp)


def log_of(scans: list[float], odometry: list[float] | None) -> Recording:
    path = None
    if odometry is not None:
        poses = np.array([[0.01 * i, -0.02 * i, 0.03 * i] for i in range(len(odometry))])
        path = Trajectory(np.array(odometry), poses)
    return Recording(tuple(scan_at(stamp) for stamp in scans), path)


@given(times, times)
def test_inputs_come_in_the_order_of_their_stamps(scans, odometry):
    recording = log_of(scans, odometry)
    inputs = list(recorded_inputs(recording))
    stamps = [given.stamp for given in inputs]
    assert stamps == sorted(scans + odometry)
    # Each kind is complete and in its own order: of equal stamps none overtakes another.
    assert [given for given in inputs if isinstance(given, LaserScan)] == list(recording.scans)
    assert [given for given in inputs if isinstance(given, Odometry)] == [
        Odometry(stamp, SE2.from_array(pose))
        for stamp, pose in zip(odometry, recording.odometry.poses, strict=True)
    ]


@given(times, times)
def test_at_one_time_odometry_comes_first(scans, odometry):
    """So that no scan has to wait for what is already known."""
    seen: set[float] = set()
    for given_ in recorded_inputs(log_of(scans, odometry)):
        if isinstance(given_, LaserScan):
            seen.add(given_.stamp)
        else:
            assert given_.stamp not in seen


def test_without_odometry_there_are_scans():
    recording = log_of([1.0, 2.0, 2.0], None)
    assert list(recorded_inputs(recording)) == list(recording.scans)


def test_a_log_is_read_as_it_is_played(driven):
    """A long one is not turned into a list first."""
    inputs = recorded_inputs(driven)
    assert iter(inputs) is inputs
    first, second = next(inputs), next(inputs)
    assert isinstance(first, Odometry)
    assert second is driven.scans[0]


def test_replay_hands_on_one_input_at_a_time(hall_plan):
    asked = []

    def inputs() -> Iterator[Input]:
        for stamp in (1.0, 2.0):
            asked.append(stamp)
            yield NewMap(stamp, hall_plan)

    localizer = Localizer()
    played = replay(inputs(), localizer)
    assert asked == []
    assert localizer.state is State.NO_MAP
    given_, outputs = next(played)
    assert (asked, given_.stamp, len(outputs)) == ([1.0], 1.0, 1)
    assert localizer.state is State.SEARCHING


@pytest.fixture(scope="module")
def played(driven, hall_plan, tmp_path_factory) -> list[list[tuple]]:
    cache, runs = tmp_path_factory.mktemp("maps"), []
    for _ in range(2):
        localizer = Localizer(cache_dir=cache)
        localizer.handle(NewMap(0.0, hall_plan))
        runs.append(list(replay(recorded_inputs(driven), localizer)))
    return runs


def test_a_drive_is_found_and_followed(played, driven):
    outputs = [output for _, out in played[0] for output in out]
    assert [o.stamp for o in outputs if isinstance(o, InitialPose)] == [driven.scans[0].stamp]
    tracked = [o for o in outputs if isinstance(o, TrackedPose)]
    assert [o.stamp for o in tracked] == [scan.stamp for scan in driven.scans]
    for pose, truth in zip(tracked, driven.truth, strict=True):
        assert pose.T_map_base.distance_to(SE2.from_array(truth)) < 0.1


def test_a_replay_repeats_to_the_last_bit(played):
    def bits(run):
        return [
            (o.stamp, o.T_map_base, o.covariance.tobytes())
            for _, out in run
            for o in out
            if isinstance(o, (InitialPose, TrackedPose))
        ]

    first, second = map(bits, played)
    assert len(first) > 60
    assert first == second


def test_a_log_without_odometry_is_never_localized(driven, hall_plan, tmp_path):
    """Scans wait for odometry, and none comes: nothing is guessed."""
    localizer = Localizer(cache_dir=tmp_path)
    localizer.handle(NewMap(0.0, hall_plan))
    recording = Recording(driven.scans[:5])
    assert [out for _, out in replay(recorded_inputs(recording), localizer)] == [[]] * 5
    assert localizer.state is State.SEARCHING
