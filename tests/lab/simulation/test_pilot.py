"""The pilot keeps to the path, slows down and stops at its end."""

import math

import numpy as np
import pytest

from firstfix.core.se2 import SE2
from firstfix.lab.simulation.pilot import CRUISE_MPS, Pilot
from firstfix.lab.simulation.wheels import arc

LSHAPE = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]])


def drive(path: np.ndarray, start: SE2) -> list[SE2]:
    """Let a robot without inertia execute the pilot's commands, for at most a minute."""
    pilot, poses = Pilot(path), [start]
    while not pilot.arrived and len(poses) < 3000:
        v, w = pilot.command(poses[-1])
        poses.append(poses[-1] @ arc(v * 0.02, w * 0.02))
    return poses


@pytest.mark.parametrize("yaw", [0.0, 2.0, math.pi])
def test_it_arrives_wherever_the_robot_looks_at_first(yaw: float) -> None:
    poses = drive(LSHAPE, SE2(0.0, 0.0, yaw))
    assert poses[-1].distance_to(SE2(3.0, 2.0, 0.0)) < 0.1


def test_it_cuts_no_corner_by_much() -> None:
    for pose in drive(LSHAPE, SE2(0.0, 0.0, 0.0)):
        off_path = min(
            math.hypot(pose.x - min(max(pose.x, 0.0), 3.0), pose.y),
            math.hypot(pose.x - 3.0, pose.y - min(max(pose.y, 0.0), 2.0)),
        )
        assert off_path < 0.2


def test_it_cruises_on_straight_parts_and_stops_at_the_end() -> None:
    pilot = Pilot(np.array([[0.0, 0.0], [5.0, 0.0]]))
    assert pilot.command(SE2(0.0, 0.0, 0.0)) == (pytest.approx(CRUISE_MPS), 0.0)
    assert pilot.command(SE2(0.5, 0.1, 0.0))[1] < 0.0
    assert pilot.command(SE2(0.5, 0.0, 2.0))[0] == 0.0  # turn first
    for x in np.arange(0.5, 4.9, 0.1):
        pilot.command(SE2(float(x), 0.0, 0.0))
    assert 0.0 < pilot.command(SE2(4.88, 0.0, 0.0))[0] < CRUISE_MPS
    assert pilot.command(SE2(4.95, 0.0, 0.0)) == (0.0, 0.0)
    assert pilot.arrived


def test_a_path_that_comes_back_is_driven_to_its_end() -> None:
    there_and_back = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 0.2]])
    assert len(drive(there_and_back, SE2(0.0, 0.0, 0.0))) * 0.02 * CRUISE_MPS > 4.0


def test_a_robot_at_the_goal_has_arrived() -> None:
    pilot = Pilot(np.array([[1.0, 1.0], [1.0, 1.0]]))
    assert pilot.command(SE2(1.0, 1.0, 0.3)) == (0.0, 0.0)
    assert pilot.arrived
