"""Whether a saved pose is used after a restart, and why not."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2
from firstfix.io.recalled_pose import RecalledPose, RecallOutcome, recall
from firstfix.io.saved_pose import SavedPose

THERE = SE2(3.0, -1.0, 2.0)
ODOMETRY = SE2(10.0, 5.0, -1.0)


def saved(T_map_base: SE2 = THERE, T_odom_base: SE2 | None = ODOMETRY) -> SavedPose:
    return SavedPose(T_map_base, 0.01 * np.eye(3), 1000.0, T_odom_base, "hall")


def recalled(
    T_odom_base: SE2 | None = ODOMETRY,
    pose: SavedPose | None = None,
    *,
    now: float = 1060.0,
    map_key: str = "hall",
    max_age_s: float = 3600.0,
    max_jump_m: float = 0.5,
) -> RecalledPose:
    return recall(
        pose or saved(),
        now=now,
        T_odom_base=T_odom_base,
        map_key=map_key,
        max_age_s=max_age_s,
        max_jump_m=max_jump_m,
    )


LENGTHS = st.floats(-100.0, 100.0)
POSES = st.builds(SE2, LENGTHS, LENGTHS, st.floats(-3.0, 3.0))
STEPS = st.builds(SE2, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))


@given(POSES, POSES, STEPS)
def test_the_increment_of_odometry_is_applied_for_any_frames(T_map_base, T_odom_base, step):
    assume((T_odom_base @ step).distance_to(SE2.identity()) > 0.1)
    now = recalled(T_odom_base @ step, saved(T_map_base, T_odom_base), max_jump_m=2.0).T_map_base
    expected = T_map_base @ step
    assert now.distance_to(expected) < 1e-9
    assert angle_error(now.yaw, expected.yaw) < 1e-9


def test_a_restarted_node_with_continued_odometry():
    step = SE2(0.3, 0.1, 0.2)
    now = recalled(ODOMETRY @ step)
    assert now.outcome is RecallOutcome.MOVED
    assert now.T_map_base is not None
    assert now.T_map_base.distance_to(THERE @ step) < 1e-9
    assert now.reason == "saved 60 s ago; the robot has moved 0.32 m since by odometry"


@pytest.mark.parametrize("start", [SE2.identity(), SE2(0.0, 0.0, 2.0), SE2(0.02, -0.02, 0.0)])
@pytest.mark.parametrize("before", [ODOMETRY, SE2.identity(), SE2(0.2, 0.0, 0.0)])
def test_after_a_restart_of_odometry_the_pose_is_unconfirmed(start, before):
    now = recalled(start, saved(T_odom_base=before))
    assert now.outcome is RecallOutcome.UNCONFIRMED
    assert now.T_map_base == THERE
    assert "odometry was restarted" in now.reason


@pytest.mark.parametrize(("before", "after"), [(None, ODOMETRY), (ODOMETRY, None), (None, None)])
def test_without_odometry_the_pose_is_unconfirmed(before, after):
    now = recalled(after, saved(T_odom_base=before))
    assert now.outcome is RecallOutcome.UNCONFIRMED
    assert now.T_map_base == THERE
    assert "without odometry" in now.reason


@pytest.mark.parametrize(
    ("situation", "reason"),
    [
        (
            {"T_odom_base": ODOMETRY @ SE2(4.1, 0, 0)},
            "the robot has moved 4.1 m",
        ),
        ({"T_odom_base": ODOMETRY @ SE2(0.2, 0, 0), "max_jump_m": 0.1}, "more than 0.1 m"),
        ({"map_key": "another hall"}, "a pose in another map"),
        ({"now": 1000.0 + 3 * 3600}, "saved 3 h ago, longer than 60 min"),
        ({"now": 1000.0 + 3 * 86400}, "saved 3 days ago"),
        ({"now": 1000.0 - 7200}, "saved 2 h in the future: the clock was set back"),
        ({"now": math.nan}, "saved"),
        ({"max_age_s": math.nan}, "longer than"),
        ({"max_jump_m": math.nan, "T_odom_base": ODOMETRY @ SE2(0.2, 0, 0)}, "odometry"),
    ],
)
def test_invalid_poses_are_rejected_with_the_reason(situation, reason):
    now = recalled(**situation)
    assert now.outcome is RecallOutcome.REJECTED
    assert now.T_map_base is None
    assert reason in now.reason


def test_the_limits_are_included():
    assert recalled(now=4600.0).outcome is RecallOutcome.MOVED
    assert recalled(now=999.5).outcome is RecallOutcome.MOVED  # clocks differ a little
    assert recalled(SE2(10.5, 5.0, 0.0)).outcome is RecallOutcome.MOVED


def test_an_infinite_age_is_allowed():
    assert recalled(now=1e9, max_age_s=math.inf).outcome is RecallOutcome.MOVED


@given(
    st.none()
    | st.builds(SE2, st.floats(-1e300, 1e300), st.floats(-1e300, 1e300), st.floats(-4, 4)),
    st.floats(),
    st.floats(),
    st.sampled_from(["hall", "", "other"]),
)
def test_there_is_a_pose_unless_it_is_rejected(T_odom_base, now, max_age_s, map_key):
    got = recalled(T_odom_base, now=now, max_age_s=max_age_s, map_key=map_key)
    assert (got.T_map_base is None) == (got.outcome is RecallOutcome.REJECTED)
    assert got.reason
