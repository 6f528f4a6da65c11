"""People walk in free space, or move with the robot."""

import numpy as np
import pytest

from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.people import Manner, People
from firstfix.lab.simulation.sweep import sweep
from firstfix.lab.worlds.drawing import Drawing


@pytest.fixture(scope="module")
def hall() -> Floor:
    """12 x 9 m with a wall across, and a gap in it."""
    plan = Drawing(12.0, 9.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 6.0, 9.0)
    plan.room(6.0, 0.0, 12.0, 9.0)
    plan.door(6.0, 4.5, width=1.2)
    return Floor(plan.grid())


def people(floor: Floor, seed: int = 1) -> People:
    return People(floor, np.random.default_rng(seed))


def places(crowd: People) -> np.ndarray:
    return crowd.circles[:, :2]


def test_a_floor_is_empty_before_people_come_and_after_they_leave(hall: Floor) -> None:
    crowd, pose = people(hall), SE2(3.0, 4.5, 0.0)
    assert crowd.circles.shape == (0, 3)
    crowd.come(5, Manner.WALK, pose)
    assert len(crowd) == 5
    crowd.come(0, Manner.WALK, pose)
    assert crowd.circles.shape == (0, 3)


@pytest.mark.parametrize("manner", Manner)
def test_they_stay_out_of_walls_and_off_the_robot(hall: Floor, manner: Manner) -> None:
    crowd, pose = people(hall), SE2(5.0, 4.5, 0.0)
    crowd.come(8, manner, pose)
    for _ in range(300):
        pose = pose @ SE2(0.01, 0.0, 0.02)
        crowd.walk(pose, 0.1)
        for x, y, radius in crowd.circles.tolist():
            assert hall.room_at(x, y) > 0.0
            assert np.hypot(x - pose.x, y - pose.y) >= radius + 0.3


def test_walking_people_move_at_a_human_pace(hall: Floor) -> None:
    crowd, pose = people(hall), SE2(3.0, 4.5, 0.0)
    crowd.come(6, Manner.WALK, pose)
    ways = np.zeros(6)
    for _ in range(300):
        before = places(crowd)
        crowd.walk(pose, 0.1)
        step = np.hypot(*(places(crowd) - before).T)
        assert step.max() <= 0.35  # a step aside from the robot included
        ways += step
    assert (ways > 6.0).all()


def test_surrounding_people_move_with_the_robot(hall: Floor) -> None:
    crowd, pose = people(hall), SE2(2.0, 3.0, 0.0)
    crowd.come(5, Manner.SURROUND, pose)
    for _ in range(100):
        pose = pose @ SE2(0.03, 0.0, 0.0)
        crowd.walk(pose, 0.1)
    away = np.hypot(*(places(crowd) - [pose.x, pose.y]).T)
    assert (away < 2.0).all()


def test_more_people_hide_more_and_four_hide_about_a_third(hall: Floor) -> None:
    lidar, rng, pose = Lidar(sigma_m=0.0), np.random.default_rng(0), SE2(3.0, 4.5, 0.0)
    alone = sweep(lidar, hall, pose, rng).ranges

    def hidden(count: int) -> float:
        shares = []
        for seed in range(20):
            crowd = people(hall, seed)
            crowd.come(count, Manner.SURROUND, pose)
            scan = sweep(lidar, hall, pose, rng, circles=crowd.circles)
            shares.append(np.mean(scan.ranges < alone - 0.01))
        return float(np.mean(shares))

    assert 0.2 < hidden(4) < 0.4
    assert hidden(2) < hidden(4) < hidden(8)


def test_one_seed_is_one_crowd(hall: Floor) -> None:
    pose = SE2(3.0, 4.5, 0.0)
    a, b, other = people(hall), people(hall), people(hall, 2)
    for crowd in (a, b, other):
        crowd.come(4, Manner.WALK, pose)
        for _ in range(50):
            crowd.walk(pose, 0.1)
    np.testing.assert_array_equal(a.circles, b.circles)
    assert (a.circles != other.circles).all()
