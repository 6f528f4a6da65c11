"""A robot drives as it is asked, if motors and walls let it."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstfix.core.odometry import SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.robot import Kobuki, Robot
from firstfix.lab.simulation.wheels import EXACT_WHEELS
from firstfix.lab.worlds.drawing import Drawing

EXACT = Kobuki(wheels=EXACT_WHEELS)
DT = 0.02


def box() -> Floor:
    """4 x 3 m; walls are 0.1 m inside its sides."""
    plan = Drawing(4.0, 3.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 4.0, 3.0)
    return Floor(plan.grid())


BOX = box()


def robot(x: float = 2.0, y: float = 1.5, yaw: float = 0.0, kobuki: Kobuki = EXACT) -> Robot:
    return Robot(kobuki, BOX, SE2(x, y, yaw), np.random.default_rng(2))


def test_exact_odometry_is_the_truth_in_another_frame() -> None:
    moved, start = robot(yaw=0.7), SE2(2.0, 1.5, 0.7)
    for v, w in [(0.2, 0.5)] * 100 + [(0.0, -1.5)] * 50 + [(-0.1, 0.3)] * 60:
        moved.drive(v, w, DT)
    T_map_base = start @ moved.T_odom_base
    np.testing.assert_allclose(T_map_base.as_array(), moved.T_map_base.as_array(), atol=1e-9)
    assert moved.T_map_base.distance_to(start) > 0.1


def test_erring_odometry_drifts_but_not_far() -> None:
    moved = robot(kobuki=Kobuki())
    for _ in range(1500):  # 30 s in circles of 0.25 m
        moved.drive(0.2, 0.8, DT)
    drift = (SE2(2.0, 1.5, 0.0) @ moved.T_odom_base).distance_to(moved.T_map_base)
    assert 0.001 < drift < 0.5


def test_it_gets_as_fast_as_its_limits_allow_and_no_faster_than_its_motors() -> None:
    moved = robot(x=0.5)
    speeds = []
    for _ in range(100):
        moved.drive(9.0, -9.0, DT)
        speeds.append((moved.v, moved.w))
    assert moved.v == pytest.approx(EXACT.v_max)
    assert moved.w == pytest.approx(-EXACT.w_max)
    for (v0, w0), (v1, w1) in itertools.pairwise(speeds):
        assert abs(v1 - v0) <= EXACT.a_max * DT + 1e-12
        assert abs(w1 - w0) <= EXACT.alpha_max * DT + 1e-12


def test_a_wall_stops_it_and_presses_its_bumper_until_it_leaves() -> None:
    moved = robot(x=3.5)
    for _ in range(100):
        moved.drive(0.4, 0.0, DT)
    assert moved.bumped
    # The wall begins at 3.9 m; half a cell of it may be within reach.
    assert 3.9 - moved.T_map_base.x == pytest.approx(0.2, abs=0.03)
    pressed = moved.T_odom_base
    for _ in range(20):
        moved.drive(0.4, 0.0, DT)
    assert moved.T_odom_base == pressed
    (signal,) = moved.signals(1.0)
    assert (signal.kind, signal.active, signal.stamp) == (SignalKind.BUMPER, True, 1.0)
    for _ in range(20):
        moved.drive(-0.2, 0.0, DT)
    assert not moved.bumped
    assert [s.active for s in moved.signals(2.0)] == [False]
    assert moved.signals(3.0) == ()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-0.5, 0.5), st.floats(-1.9, 1.9)), min_size=1, max_size=12))
def test_no_command_drives_the_robot_into_a_wall(
    commands: list[tuple[float, float]],
) -> None:
    moved = robot(kobuki=Kobuki())
    for v, w in commands:
        for _ in range(40):
            moved.drive(v, w, DT)
        moved.push(SE2(v, w / 4.0, 0.1))
        assert BOX.room_at(moved.T_map_base.x, moved.T_map_base.y) >= EXACT.radius_m


def test_put_too_near_a_wall_it_can_leave() -> None:
    moved = robot(x=0.2)
    for _ in range(200):
        moved.drive(0.3, 0.0, DT)
    assert moved.T_map_base.x > 1.0


def test_a_push_moves_the_robot_and_not_its_wheels() -> None:
    moved = robot(yaw=math.pi / 2)
    moved.push(SE2(0.3, 0.4, 0.35))
    np.testing.assert_allclose(
        moved.T_map_base.as_array(), [1.6, 1.8, math.pi / 2 + 0.35], atol=1e-9
    )
    assert moved.T_odom_base == SE2.identity()
    moved.push(SE2(9.0, 0.0, 0.0))
    assert BOX.room_at(moved.T_map_base.x, moved.T_map_base.y) >= EXACT.radius_m


def test_spinning_wheels_move_odometry_and_not_the_robot() -> None:
    moved = robot()
    moved.spin_wheels(0.3, 0.0)
    assert moved.T_map_base == SE2(2.0, 1.5, 0.0)
    assert moved.T_odom_base.x == pytest.approx(0.3)


def test_in_the_air_wheels_count_nothing_and_the_floor_is_gone() -> None:
    moved = robot()
    moved.lift()
    assert {(s.kind, s.active) for s in moved.signals(0.0)} == {
        (SignalKind.WHEEL_DROP, True),
        (SignalKind.CLIFF, True),
    }
    for _ in range(50):
        moved.drive(0.5, 1.0, DT)
    moved.place(SE2(1.0, 1.0, 0.0))
    assert moved.T_odom_base == SE2.identity()
    moved.set_down()
    assert not moved.lifted
    assert {s.active for s in moved.signals(1.0)} == {False}
