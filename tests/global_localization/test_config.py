"""Settings are checked where they are made."""

from __future__ import annotations

import dataclasses
import math

import pytest

from firstfix.core.errors import InputError
from firstfix.fields.range_table import DIRECTIONS
from firstfix.fields.search_grid import MAX_POSITIONS
from firstfix.global_localization.config import LocateConfig, Method


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_poses", 0),
        ("max_poses", 1.5),
        ("shortlist", 0),
        ("hypotheses", 1),
        ("unique_probability", -0.01),
        ("unique_probability", 1.01),
        ("unique_probability", math.nan),
    ],
)
def test_a_setting_out_of_range_is_named(name, value):
    with pytest.raises(InputError, match=name):
        LocateConfig(**{name: value})


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"max_poses": 1},
        {"max_poses": 2**53},
        {"shortlist": 1, "hypotheses": 2},
        {"unique_probability": 0.0},
        {"unique_probability": 1.0},
    ],
)
def test_the_ends_of_every_range_are_allowed(settings):
    config = LocateConfig(**settings)
    for name, value in settings.items():
        assert getattr(config, name) == value


def test_settings_do_not_change():
    with pytest.raises(dataclasses.FrozenInstanceError):
        LocateConfig().max_poses = 1  # type: ignore[misc]


def test_methods_have_the_names_of_the_command_line():
    assert {method.value for method in Method} == {"fast", "paper", "paper-basic"}


def test_by_default_the_largest_search_grid_is_searched_whole():
    assert LocateConfig().max_poses == MAX_POSITIONS * DIRECTIONS
