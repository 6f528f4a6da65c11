"""Replaying a log: one input at a time, and every replay gives the same outputs."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, TrackedPose
from firstfix.localizer.replay import replay
from firstfix.localizer.states import State


def test_replay_passes_one_input_at_a_time(hall_plan):
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
        runs.append(list(replay(driven.messages(), localizer)))
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
    assert [out for _, out in replay(recording.messages(), localizer)] == [[]] * 5
    assert localizer.state is State.SEARCHING
