"""Inputs carry their own time, and stay as they are."""

from __future__ import annotations

import dataclasses
from typing import get_args

import pytest

from firstfix.core.odometry import Odometry, Signal
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import (
    Input,
    MapHint,
    NewMap,
    NoMotionUpdate,
    PoseHint,
    PositionFix,
    Reset,
)


def test_every_input_has_a_stamp_of_its_own() -> None:
    kinds = get_args(Input)
    requests = {MapHint, PoseHint, PositionFix, Reset, NoMotionUpdate}
    assert set(kinds) == {NewMap, LaserScan, Odometry, Signal} | requests
    for kind in kinds:
        (stamp,) = (field for field in dataclasses.fields(kind) if field.name == "stamp")
        assert stamp.type == "float"


def test_inputs_are_immutable(hall_plan) -> None:
    given = [NewMap(1.0, hall_plan), PoseHint(1.0, SE2.identity()), Reset(1.0), NoMotionUpdate(1.0)]
    for message in given:
        with pytest.raises(dataclasses.FrozenInstanceError):
            message.stamp = 2.0
