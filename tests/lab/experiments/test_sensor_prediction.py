"""Predictions for a hall without symmetry, and for rooms that look alike."""

from dataclasses import replace

import numpy as np
import pytest

from firstfix.core.errors import MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.lab.experiments import sensor_prediction
from firstfix.lab.experiments.sensor_prediction import Answer, Effort, predict, share
from firstfix.lab.simulation.rigs import RIGS, parse_rig
from firstfix.lab.worlds.catalog import identical_rooms
from firstfix.lab.worlds.drawing import Drawing


def nothing(_: str) -> None:
    pass


def test_a_good_sensor_is_found_at_once_in_a_hall(hall_plan: OccupancyGrid) -> None:
    done: list[str] = []
    found = predict(hall_plan, RIGS["lidar"], 4, 0, done.append)
    assert done == ["right"] * 4
    assert all(set(prediction.answers.values()) == {Answer.RIGHT} for prediction in found)


def test_in_rooms_that_look_alike_nothing_helps() -> None:
    found = predict(identical_rooms(2), parse_rig("360,8"), 3, 0, nothing)
    assert [share(found, effort, Answer.OPEN) for effort in Effort] == [1.0, 1.0, 1.0]


def test_a_camera_must_look_around(hall_plan: OccupancyGrid) -> None:
    found = predict(hall_plan, RIGS["depth-camera"], 3, 1, nothing)
    assert share(found, Effort.SCAN, Answer.RIGHT) < share(found, Effort.TURN, Answer.RIGHT)
    assert share(found, Effort.SCAN, Answer.WRONG) == 0.0


def test_a_sensor_that_sees_nothing_is_told_apart() -> None:
    plan = Drawing(30.0, 30.0, 0.1, 0.5)
    plan.room(0.0, 0.0, 30.0, 30.0)
    plan.solid(3.0, 3.0, 4.0, 4.5)
    (found,) = predict(plan.grid(), parse_rig("90,1.5"), 1, 0, nothing)
    assert found.sees_little
    assert set(found.answers.values()) == {Answer.OPEN}


def test_the_number_of_threads_does_not_matter(
    hall_plan: OccupancyGrid, monkeypatch: pytest.MonkeyPatch
) -> None:
    many = predict(hall_plan, parse_rig("120,3"), 3, 5, nothing)
    monkeypatch.setattr(sensor_prediction.os, "cpu_count", lambda: 1)
    assert predict(hall_plan, parse_rig("120,3"), 3, 5, nothing) == many


def test_robots_face_where_they_can_drive(hall_plan: OccupancyGrid) -> None:
    for prediction in predict(hall_plan, RIGS["lidar"], 4, 2, nothing):
        ahead = sensor_prediction._room(prediction.T_map_base, hall_plan, np.zeros(1))
        # A box may stand before the wall.
        assert ahead[0] >= 0.9


def test_a_map_without_walls_is_refused(hall_plan: OccupancyGrid) -> None:
    empty = replace(hall_plan, cells=0 * hall_plan.cells)
    with pytest.raises(MapError):
        predict(empty, RIGS["lidar"], 1, 0, nothing)
