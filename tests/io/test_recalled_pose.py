"""Which saved pose a robot believes, in the situations that robots get into."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.io.recalled_pose import RecalledPose, Standing, carried, recall
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


@given(POSES, POSES, POSES)
def test_a_pose_is_carried_by_the_increment_whatever_the_frames(T_map_base, T_odom_base, step):
    now = carried(saved(T_map_base, T_odom_base), T_odom_base @ step)
    expected = T_map_base @ step
    assert now.distance_to(expected) < 1e-9
    assert angle_error(now.yaw, expected.yaw) < 1e-9


@given(POSES, POSES, POSES, POSES)
def test_carrying_twice_is_carrying_once(T_map_base, T_odom_base, middle, end):
    first = saved(T_map_base, T_odom_base)
    once = carried(first, end)
    twice = carried(saved(carried(first, middle), middle), end)
    assert once.distance_to(twice) < 1e-9
    assert angle_error(once.yaw, twice.yaw) < 1e-9


def test_without_odometry_nothing_is_carried():
    with pytest.raises(InputError, match="saved with odometry"):
        carried(saved(T_odom_base=None), ODOMETRY)


def test_a_node_that_was_restarted_while_the_base_ran_on():
    step = SE2(0.3, 0.1, 0.2)
    now = recalled(ODOMETRY @ step)
    assert now.standing is Standing.CARRIED
    assert now.T_map_base is not None
    assert now.T_map_base.distance_to(THERE @ step) < 1e-9
    assert now.why == "saved 60 s ago; odometry says that the robot has moved 0.32 m since"


@pytest.mark.parametrize("start", [SE2.identity(), SE2(0.0, 0.0, 2.0), SE2(0.02, -0.02, 0.0)])
@pytest.mark.parametrize("before", [ODOMETRY, SE2.identity(), SE2(0.2, 0.0, 0.0)])
def test_a_robot_that_was_switched_off_cannot_know_whether_it_was_moved(start, before):
    now = recalled(start, saved(T_odom_base=before))
    assert now.standing is Standing.UNCONFIRMED
    assert now.T_map_base == THERE
    assert "odometry stands at its start" in now.why


@pytest.mark.parametrize(("before", "after"), [(None, ODOMETRY), (ODOMETRY, None), (None, None)])
def test_a_robot_without_odometry(before, after):
    now = recalled(after, saved(T_odom_base=before))
    assert now.standing is Standing.UNCONFIRMED
    assert now.T_map_base == THERE
    assert "no odometry" in now.why


@pytest.mark.parametrize(
    ("situation", "why"),
    [
        (
            {"T_odom_base": ODOMETRY @ SE2(4.1, 0, 0)},
            "odometry says that the robot has moved 4.1 m",
        ),
        ({"T_odom_base": ODOMETRY @ SE2(0.2, 0, 0), "max_jump_m": 0.1}, "more than 0.1 m"),
        ({"map_key": "another hall"}, "the map is another one"),
        ({"now": 1000.0 + 3 * 3600}, "saved 3 h ago, longer than 60 min"),
        ({"now": 1000.0 + 3 * 86400}, "saved 3 days ago"),
        ({"now": 1000.0 - 7200}, "saved 2 h in the future: the clock was set back"),
        ({"now": math.nan}, "saved"),
        ({"max_age_s": math.nan}, "longer than"),
        ({"max_jump_m": math.nan, "T_odom_base": ODOMETRY @ SE2(0.2, 0, 0)}, "odometry"),
    ],
)
def test_what_is_refused_and_why(situation, why):
    now = recalled(**situation)
    assert now.standing is Standing.REFUSED
    assert now.T_map_base is None
    assert why in now.why


def test_the_limits_themselves_are_allowed():
    assert recalled(now=4600.0).standing is Standing.CARRIED
    assert recalled(now=999.5).standing is Standing.CARRIED  # clocks differ a little
    assert recalled(SE2(10.5, 5.0, 0.0)).standing is Standing.CARRIED


def test_a_robot_that_nobody_moves_may_be_given_any_age():
    assert recalled(now=1e9, max_age_s=math.inf).standing is Standing.CARRIED


@given(
    st.none()
    | st.builds(SE2, st.floats(-1e300, 1e300), st.floats(-1e300, 1e300), st.floats(-4, 4)),
    st.floats(),
    st.floats(),
    st.sampled_from(["hall", "", "other"]),
)
def test_there_is_a_pose_unless_it_is_refused(T_odom_base, now, max_age_s, map_key):
    got = recalled(T_odom_base, now=now, max_age_s=max_age_s, map_key=map_key)
    assert (got.T_map_base is None) == (got.standing is Standing.REFUSED)
    assert got.why
