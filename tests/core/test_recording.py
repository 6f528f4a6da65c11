"""A log of a drive: what it holds, and its messages in the order of time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError, ScanError
from firstfix.core.odometry import Odometry
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory

SCAN = LaserScan(np.ones(3), -0.1, 0.1, 0.0, 10.0)


def test_a_recording_is_as_long_as_its_scans() -> None:
    recording = Recording((SCAN, SCAN), truth=np.zeros((2, 3)), runs=np.zeros(2, np.int64))
    assert len(recording) == 2


def test_an_empty_log_is_refused() -> None:
    with pytest.raises(ScanError, match="at least one scan"):
        Recording(())


def test_truth_must_fit_the_scans() -> None:
    with pytest.raises(ScanError, match=r"truth of shape \(1, 3\)"):
        Recording((SCAN,), truth=np.zeros((2, 3)))


def test_runs_must_fit_the_scans() -> None:
    with pytest.raises(ScanError, match=r"runs of shape \(1,\)"):
        Recording((SCAN,), runs=np.zeros(3, np.int64))


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
def test_messages_are_in_the_order_of_their_stamps(
    scans: list[float], odometry: list[float]
) -> None:
    recording = log_of(scans, odometry)
    messages = list(recording.messages())
    stamps = [message.stamp for message in messages]
    assert stamps == sorted(scans + odometry)
    # Each kind is complete and keeps its own order, also at equal stamps.
    assert [m for m in messages if isinstance(m, LaserScan)] == list(recording.scans)
    assert recording.odometry is not None
    assert [m for m in messages if isinstance(m, Odometry)] == [
        Odometry(stamp, SE2.from_array(pose))
        for stamp, pose in zip(odometry, recording.odometry.poses, strict=True)
    ]


@given(times, times)
def test_at_equal_stamps_odometry_comes_first(scans: list[float], odometry: list[float]) -> None:
    seen: set[float] = set()
    for message in log_of(scans, odometry).messages():
        if isinstance(message, LaserScan):
            seen.add(message.stamp)
        else:
            assert message.stamp not in seen


def test_without_odometry_the_messages_are_the_scans() -> None:
    recording = log_of([1.0, 2.0, 2.0], None)
    assert list(recording.messages()) == list(recording.scans)


def test_messages_are_made_one_at_a_time() -> None:
    messages = log_of([1.0], [1.0]).messages()
    assert iter(messages) is messages
    assert isinstance(next(messages), Odometry)


def test_a_list_of_scans_becomes_a_tuple_and_other_things_are_refused() -> None:
    assert Recording([SCAN]).scans == (SCAN,)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"scans as a LaserScan, received ndarray"):
        Recording(np.ones((2, 3)))  # type: ignore[arg-type]


def test_scans_of_two_sensors_are_put_together_by_time():
    at = [(0.0, 0), (0.04, 1), (0.1, 0), (0.14, 1), (0.2, 0), (0.9, 0)]
    scans = tuple(LaserScan(np.ones(3), 0.0, 0.1, 0.1, 5.0, stamp=stamp) for stamp, _ in at)
    recording = Recording(scans, sensors=np.array([sensor for _, sensor in at]))
    assert recording.instants() == [(0, 1), (2, 3), (4, 3), (5,)]


def test_scans_of_one_sensor_stand_alone():
    scans = tuple(LaserScan(np.ones(3), 0.0, 0.1, 0.1, 5.0, stamp=float(i)) for i in range(2))
    assert Recording(scans).instants() == [(0,), (1,)]
