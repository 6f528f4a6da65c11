"""Odometry at the time of a scan: interpolated, never guessed; jumps are noticed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import angle_error
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.localizer.odometry_buffer import OdometryBuffer

# Up to 3 m/s and 10 rad/s: no jumps.
STEPS = st.lists(
    st.tuples(
        st.floats(0.01, 0.5), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-10.0, 10.0)
    ),
    min_size=1,
    max_size=20,
)


def filled(*messages: tuple[float, SE2]) -> OdometryBuffer:
    buffer = OdometryBuffer()
    for stamp, pose in messages:
        assert not buffer.add(Odometry(stamp, pose))
    return buffer


def ramp(stamp: float) -> SE2:
    return SE2(0.1 * stamp, -0.05 * stamp, 0.02 * stamp)


def test_an_empty_buffer_has_no_odometry() -> None:
    buffer = OdometryBuffer()
    assert buffer.last is None
    assert buffer.at(0.0) is None


@given(
    begin=st.floats(-1e6, 1e6),
    steps=STEPS,
    asked=st.lists(st.floats(-0.2, 1.2), min_size=1, max_size=10),
)
def test_the_buffer_interpolates_as_a_trajectory_does(
    begin: float, steps: list[tuple[float, float, float, float]], asked: list[float]
) -> None:
    stamps, poses = [begin], [SE2(99.0, 0.0, 3.0)]  # far from zero, where it would begin anew
    for seconds, vx, vy, w in steps:
        last = poses[-1]
        stamps.append(stamps[-1] + seconds)
        poses.append(SE2(last.x + vx * seconds, last.y + vy * seconds, last.yaw + w * seconds))
    buffer = filled(*zip(stamps, poses, strict=True))
    twin = Trajectory(np.array(stamps), np.array([pose.as_array() for pose in poses]))
    for stamp in [*stamps, *(begin + share * (stamps[-1] - begin) for share in asked)]:
        ours, theirs = buffer.at(stamp), twin.at(stamp)
        assert (ours is None) == (theirs is None)
        if ours is not None and theirs is not None:
            assert ours.distance_to(theirs) < 1e-9
            assert angle_error(ours.yaw, theirs.yaw) < 1e-9


@given(st.floats(0.0, 1.0))
def test_between_two_messages_it_is_a_line(share: float) -> None:
    pose = filled((10.0, SE2(1.0, 2.0, 0.1)), (12.0, SE2(2.0, 0.0, 0.5))).at(10.0 + 2.0 * share)
    assert pose is not None
    assert pose.as_array() == pytest.approx([1.0 + share, 2.0 - 2.0 * share, 0.1 + 0.4 * share])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_interpolation_across_pi_turns_the_short_way(sign: float) -> None:
    buffer = filled((0.0, SE2(0.0, 0.0, sign * 3.0)), (1.0, SE2(0.0, 0.0, sign * -3.0)))
    for share in (0.25, 0.5, 0.75):
        pose = buffer.at(share)
        assert pose is not None
        expected = sign * (3.0 + share * (2.0 * math.pi - 6.0))
        assert angle_error(pose.yaw, expected) < 1e-12


def test_there_is_no_odometry_outside_the_received_times() -> None:
    buffer = filled((1.0, ramp(1.0)), (2.0, ramp(2.0)))
    assert buffer.at(1.0) == ramp(1.0)
    assert buffer.at(2.0) == ramp(2.0)
    for stamp in (math.nextafter(1.0, 0.0), math.nextafter(2.0, 3.0), -1e300, 1e300):
        assert buffer.at(stamp) is None


def test_the_buffer_holds_the_last_2000() -> None:
    buffer = filled(*((0.02 * i, ramp(0.02 * i)) for i in range(2001)))
    assert buffer.at(0.0) is None
    assert buffer.at(0.019) is None
    assert buffer.at(0.02) == ramp(0.02)
    assert buffer.last == Odometry(40.0, ramp(40.0))
    assert buffer.at(40.0) == ramp(40.0)


def test_of_two_messages_of_one_time_the_later_counts() -> None:
    buffer = filled((0.0, ramp(0.0)), (1.0, ramp(1.0)), (1.0, SE2(0.2, 0.0, 0.0)))
    assert buffer.at(1.0) == SE2(0.2, 0.0, 0.0)
    assert buffer.at(0.5) == SE2(0.1, 0.0, 0.0)
    # The replaced one has left nothing behind.
    assert not buffer.add(Odometry(2.0, SE2(0.4, 0.0, 0.0)))
    assert buffer.at(1.5) == SE2(0.30000000000000004, 0.0, 0.0)


@pytest.mark.parametrize(
    ("seconds", "moved"),
    [
        (0.02, SE2(5.0, 0.0, 0.0)),  # a teleport
        (0.02, SE2(0.41, 0.0, 0.0)),
        (1.0, SE2(0.0, -5.4, 0.0)),
        (0.0, SE2(0.31, 0.0, 0.0)),
        (0.02, SE2(0.0, 0.0, 3.0)),
        (0.02, SE2(0.0, 0.0, -0.9)),
        (-0.02, SE2(0.0, 0.0, 0.0)),  # the clock went back
        (-1000.0, SE2(0.0, 0.0, 0.0)),
    ],
)
def test_a_jump_is_detected_and_earlier_odometry_discarded(seconds: float, moved: SE2) -> None:
    begin = SE2(3.0, 4.0, 2.0)
    buffer = filled((99.0, begin), (100.0, begin))
    now = Odometry(100.0 + seconds, begin @ moved)
    assert buffer.add(now)
    assert buffer.last == now
    assert buffer.at(99.0 + seconds / 2.0) is None
    assert buffer.at(now.stamp) == now.T_odom_base
    # From here on it goes on as if this were the first.
    onwards = Odometry(now.stamp + 1.0, now.T_odom_base @ SE2(1.0, 0.0, 0.0))
    assert not buffer.add(onwards)
    between = buffer.at(now.stamp + 0.5)
    assert between is not None
    assert between.distance_to(now.T_odom_base @ SE2(0.5, 0.0, 0.0)) < 1e-9


@pytest.mark.parametrize(
    ("seconds", "moved"),
    [
        (0.02, SE2(0.39, 0.0, 0.0)),
        (0.02, SE2(0.0, 0.0, -0.8)),
        (1.0, SE2(4.0, 3.0, 0.0)),
        (1.0, SE2(0.0, 0.0, math.pi)),
        (0.0, SE2(0.29, 0.0, 0.5)),
        (3600.0, SE2(1000.0, 0.0, 1.0)),  # after a long gap anything is possible
    ],
)
def test_possible_motions_are_not_jumps(seconds: float, moved: SE2) -> None:
    begin = SE2(3.0, 4.0, 2.0)
    buffer = filled((99.0, begin), (100.0, begin))
    assert not buffer.add(Odometry(100.0 + seconds, begin @ moved))
    assert buffer.at(99.0) == begin


@pytest.mark.parametrize("seconds", [0.1, 3.0, 3600.0])
@pytest.mark.parametrize("start", [SE2.identity(), SE2(0.03, -0.03, 2.0)])
def test_odometry_restarted_at_zero_is_a_jump_however_long_it_was_silent(
    seconds: float, start: SE2
) -> None:
    buffer = filled((100.0, SE2(0.4, 0.0, 1.0)))
    assert buffer.add(Odometry(100.0 + seconds, start))


def test_odometry_near_its_start_is_not_taken_for_a_restart() -> None:
    filled(*((0.1 * i, SE2(0.25 * i - 3.0, 0.0, 0.0)) for i in range(25)))
    filled(*((0.5 * i, SE2(0.0, 0.0, i - 3.0)) for i in range(7)))


@pytest.mark.parametrize(
    ("moved", "seconds", "is_leap"),
    [
        (SE2(0.49, 0.0, 0.5), 0.79, False),
        (SE2(0.0, 0.51, 0.0), 0.79, True),
        (SE2(0.0, 0.0, -0.53), 0.79, True),
        (SE2(0.0, 0.0, 0.0), 0.79, False),
        (SE2(0.0, 0.0, 0.0), 0.81, True),  # more than a second: the robot may have been off
        (SE2(0.0, 0.51, 0.0), 0.3001, True),
        (SE2(0.0, 0.51, 0.0), 0.2999, False),  # a fast robot, at the same rate of messages
    ],
)
def test_a_long_step_or_a_long_silence_after_missing_messages_is_a_leap(
    moved: SE2, seconds: float, *, is_leap: bool
) -> None:
    begin = SE2(3.0, 4.0, 2.0)
    one, two = Odometry(99.875, begin), Odometry(100.0, begin)
    buffer = OdometryBuffer()
    for message in (one, two):
        assert not buffer.leaps(message)
        buffer.add(message)
    assert buffer.leaps(Odometry(100.0 + seconds * 1.25, begin @ moved)) is is_leap


def test_odometry_restarted_at_zero_is_a_jump() -> None:
    buffer = filled(*((0.1 * i, SE2(0.1 * i, 0.0, 0.0)) for i in range(50)))
    assert buffer.add(Odometry(5.0, SE2.identity()))
