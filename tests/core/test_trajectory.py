"""Poses over time: exact at the stamps, interpolated between them, unknown outside."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory

PATH = Trajectory(
    np.array([1.0, 2.0, 4.0]), np.array([[0.0, 0.0, 3.0], [1.0, 0.0, -3.0], [1.0, 2.0, 0.0]])
)


def test_a_stamp_gives_its_own_pose() -> None:
    for stamp, pose in zip(PATH.stamps, PATH.poses, strict=True):
        assert PATH.at(float(stamp)) == SE2.from_array(pose)
    assert len(PATH) == 3


def test_halfway_lies_halfway_and_yaw_takes_the_shorter_way() -> None:
    pose = PATH.at(1.5)
    assert pose is not None
    assert (pose.x, pose.y) == pytest.approx((0.5, 0.0))
    assert angle_error(pose.yaw, math.pi) < 1e-9


@given(st.floats(1.0, 4.0))
def test_every_time_between_first_and_last_has_a_pose_between(stamp: float) -> None:
    pose = PATH.at(stamp)
    assert pose is not None
    assert 0.0 <= pose.x <= 1.0
    assert 0.0 <= pose.y <= 2.0


@pytest.mark.parametrize("stamp", [0.999, 4.001, -math.inf, math.inf])
def test_outside_of_the_stamps_there_is_no_pose(stamp: float) -> None:
    assert PATH.at(stamp) is None


def test_an_empty_trajectory_has_no_pose() -> None:
    assert Trajectory(np.empty(0), np.empty((0, 3))).at(0.0) is None


def test_two_poses_at_one_stamp_are_accepted() -> None:
    twice = Trajectory(np.array([0.0, 1.0, 1.0, 2.0]), np.zeros((4, 3)))
    assert twice.at(1.0) == SE2.identity()
    assert twice.at(1.5) == SE2.identity()


def test_arrays_are_copies_and_read_only() -> None:
    stamps = np.array([0.0, 1.0])
    path = Trajectory(stamps, np.zeros((2, 3)))
    stamps[0] = 5.0
    assert path.stamps.tolist() == [0.0, 1.0]
    with pytest.raises(ValueError, match="read-only"):
        path.poses[0, 0] = 1.0


@pytest.mark.parametrize(
    ("stamps", "poses", "expected"),
    [
        ([0.0, 1.0], np.zeros((3, 3)), "n stamps"),
        ([[0.0]], np.zeros((1, 3)), "n stamps"),
        ([0.0], np.zeros((1, 2)), "n stamps"),
        ([math.nan], np.zeros((1, 3)), "finite"),
        ([0.0], np.full((1, 3), math.inf), "finite"),
        ([0.0, 2.0, 1.0], np.zeros((3, 3)), "step back at pose 2"),
    ],
)
def test_invalid_trajectories_are_refused(
    stamps: list[float], poses: np.ndarray, expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        Trajectory(np.array(stamps), poses)
