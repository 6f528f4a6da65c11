"""Shares with their sentences, and heat maps."""

from pathlib import Path

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.sensor_prediction import Answer, Effort, Prediction
from firstfix.lab.reports.prediction_report import draw_predictions, prediction_text, smoothed


def at(x: float, *answers: Answer, sees_little: bool = False) -> Prediction:
    return Prediction(SE2(x, 2.0, 0.0), dict(zip(Effort, answers, strict=True)), sees_little)


PLACES = [
    at(2.0, Answer.RIGHT, Answer.RIGHT, Answer.RIGHT),
    at(4.0, Answer.OPEN, Answer.RIGHT, Answer.OPEN),
    at(6.0, Answer.OPEN, Answer.OPEN, Answer.WRONG, sees_little=True),
    at(8.0, Answer.OPEN, Answer.RIGHT, Answer.RIGHT),
]


def test_every_share_has_a_sentence() -> None:
    title, *lines = prediction_text("60° x 5 m", PLACES, 3).splitlines()
    assert title.startswith("60° x 5 m, at 4 random places (seed 3), among unmapped")
    assert [line[:27] for line in lines] == [
        "one scan              25.0%",
        "one turn in place     75.0%",
        "one metre of driving  50.0%",
        "wrong pose            25.0%",
        "sees too little       25.0%",
    ]
    assert all(len(line) > 40 for line in lines)
    assert len(prediction_text("x", PLACES[:1], 3).splitlines()) == 4


def test_heat_is_that_of_the_places_around() -> None:
    places = np.array([[0.0, 0.0], [10.0, 0.0]])
    points = np.array([[[0.0, 0.0], [5.0, 0.0]], [[10.0, 0.0], [500.0, 0.0]]])
    heat = smoothed(points, places, np.array([True, False]), area_m2=8.0)
    np.testing.assert_allclose(heat, [[1.0, 0.5], [0.0, 0.0]], atol=1e-3)


@pytest.mark.slow
def test_a_picture_has_a_row_for_each_sensor(hall_plan: OccupancyGrid, tmp_path: Path) -> None:
    one, two = (
        draw_predictions(hall_plan, [("60° x 5 m", PLACES)] * n, tmp_path / f"{n}.png")
        for n in (1, 2)
    )
    assert two.stat().st_size > one.stat().st_size > 5000
