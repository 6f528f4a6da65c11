"""Planned ways lead to their goals and keep away from walls."""

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.planner import COMFORT_M, Planner
from firstfix.lab.worlds.catalog import WORLDS, random_free_pose
from firstfix.lab.worlds.drawing import Drawing

TIGHTEST = 0.23


def room_along(floor: Floor, path: np.ndarray) -> np.ndarray:
    """Room at points 2 cm apart, m."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    along = np.arange(0.0, lengths[-1], 0.02)
    x, y = (np.interp(along, lengths, side) for side in path.T)
    return np.array([floor.room_at(*point) for point in zip(x, y, strict=True)])


def two_rooms(width: float, T_map_plan: SE2 = SE2(0.0, 0.0, 0.0)) -> Floor:  # noqa: B008 - a value
    """Two rooms of 3 x 4 m with a door so wide (m) between them."""
    plan = Drawing(6.0, 4.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 3.0, 4.0)
    plan.room(3.0, 0.0, 6.0, 4.0)
    plan.door(3.0, 2.0, width)
    grid = plan.grid()
    return Floor(OccupancyGrid(grid.cells, grid.resolution, T_map_plan @ grid.T_map_grid))


@pytest.mark.parametrize("name", WORLDS)
def test_in_every_world_ways_reach_their_goals_and_keep_clear(name: str) -> None:
    floor, rng = Floor(WORLDS[name]()), np.random.default_rng(4)
    planner = Planner(floor, TIGHTEST)
    for _ in range(4):
        start = random_free_pose(floor.grid, rng, clearance_m=0.4)
        goal = planner.random_goal(start, rng)
        path = planner.path(start, goal)
        np.testing.assert_array_equal(path[[0, -1]], [[start.x, start.y], [goal.x, goal.y]])
        room = room_along(floor, path)
        assert room.min() > TIGHTEST - 0.05  # a cell of the map
        assert np.mean(room >= 0.35) > 0.9


def test_in_a_map_that_lies_elsewhere_the_way_is_as_long_and_as_clear() -> None:
    T = SE2(5.0, -3.0, 0.7)
    start, goal = SE2(0.7, 0.7, 0.0), SE2(5.0, 3.3, 0.0)
    here, there = two_rooms(0.9), two_rooms(0.9, T)
    path = Planner(here, TIGHTEST).path(start, goal)
    moved = Planner(there, TIGHTEST).path(T @ start, T @ goal)
    # Lines along the edges of cells may be rounded to either side, so corners may differ.
    np.testing.assert_allclose(moved[[0, -1]], T.apply(path[[0, -1]]), atol=1e-9)
    room, room_moved = room_along(here, path), room_along(there, moved)
    assert len(room_moved) == pytest.approx(len(room), rel=0.03)
    assert room_moved.min() == pytest.approx(room.min(), abs=0.1)


def test_in_the_open_a_way_is_straight() -> None:
    floor = two_rooms(0.9)
    path = Planner(floor, TIGHTEST).path(SE2(0.8, 0.8, 0.0), SE2(2.2, 3.1, 0.0))
    assert len(path) == 2


def test_through_a_door_the_way_leads_in_its_middle() -> None:
    floor = two_rooms(0.9)
    path = Planner(floor, TIGHTEST).path(SE2(1.0, 1.0, 0.0), SE2(5.0, 1.0, 0.0))
    assert room_along(floor, path).min() > 0.3


def test_where_the_robot_does_not_fit_there_is_no_way() -> None:
    planner = Planner(two_rooms(0.4), TIGHTEST)
    with pytest.raises(InputError, match="No path leads"):
        planner.path(SE2(1.0, 1.0, 0.0), SE2(5.0, 1.0, 0.0))


def test_random_goals_can_be_reached_and_have_room() -> None:
    floor, rng = two_rooms(0.4), np.random.default_rng(1)
    planner = Planner(floor, TIGHTEST)
    goals = [planner.random_goal(SE2(1.0, 1.0, 0.0), rng) for _ in range(50)]
    assert all(goal.x < 3.0 for goal in goals)
    assert all(floor.room_at(goal.x, goal.y) >= COMFORT_M for goal in goals)


def test_from_beside_a_wall_the_way_leads_off_it_first() -> None:
    floor = two_rooms(0.9)
    path = Planner(floor, TIGHTEST).path(SE2(0.15, 2.0, 0.0), SE2(2.0, 2.0, 0.0))
    assert path[0].tolist() == [0.15, 2.0]


@pytest.mark.parametrize("place", [SE2(-30.0, 2.0, 0.0), SE2(90.0, 90.0, 0.0)])
def test_far_from_any_room_is_no_place(place: SE2) -> None:
    planner = Planner(two_rooms(0.9), TIGHTEST)
    with pytest.raises(InputError, match="no room for the robot"):
        planner.path(place, SE2(1.0, 1.0, 0.0))
