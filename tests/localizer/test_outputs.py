"""Outputs carry the time of what led to them, and stay as they are."""

from __future__ import annotations

import dataclasses
from typing import get_args

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.localizer.outputs import (
    Hypotheses,
    InitialPose,
    MapSwitched,
    MotionRequest,
    Output,
    Status,
    TrackedPose,
)
from firstfix.localizer.states import State

ONE_OF_EACH = [
    InitialPose(1.0, SE2.identity(), np.eye(3)),
    TrackedPose(1.0, SE2.identity(), np.eye(3), SE2.identity()),
    Hypotheses(1.0, ()),
    MapSwitched(1.0, "ground", OccupancyGrid(np.zeros((2, 2), np.int8), 0.05)),
    MotionRequest(1.0, 0.5, 1.0, 0.2),
    Status(1.0, State.SEARCHING, "no map yet"),
]


def test_every_output_has_an_example_here() -> None:
    assert {type(output) for output in ONE_OF_EACH} == set(get_args(Output))


@pytest.mark.parametrize("output", ONE_OF_EACH, ids=lambda output: type(output).__name__)
def test_outputs_have_a_stamp_and_are_immutable(output) -> None:
    assert output.stamp == 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        output.stamp = 2.0


def test_a_status_need_not_have_evidence() -> None:
    assert Status(1.0, State.SEARCHING, "no map yet").evidence is None
