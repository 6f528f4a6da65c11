"""Settings: the defaults make sense together, nonsense is refused by name."""

from __future__ import annotations

import dataclasses
import math

import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.global_localization.config import LocateConfig
from firstfix.localizer.config import LocalizerConfig, MonitorConfig

NAMES = [field.name for field in dataclasses.fields(MonitorConfig)]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [0, -1, -0.5, math.nan, math.inf])
def test_a_value_that_is_not_positive_is_refused_by_name(name, value):
    with pytest.raises(InputError, match=rf"expected {name} \(.*received {value}"):
        MonitorConfig(**{name: value})


def test_a_doubt_comes_before_a_contradiction():
    config = MonitorConfig()
    assert config.doubtful_cost < config.contradiction_cost
    assert config.confirmations >= 2  # one scan alone does not move the pose
    assert config.decided_views >= 2
    assert config.search_period_s < config.lost_after_s


def test_every_setting_has_a_description_and_a_range():
    for entry in dataclasses.fields(MonitorConfig):
        assert entry.metadata["description"]
        assert 0.0 < entry.metadata["least"] <= entry.default <= entry.metadata["most"]


def test_the_tree_holds_the_defaults_of_its_parts_and_no_two_share_one():
    config = LocalizerConfig()
    assert (config.locate, config.amcl, config.monitor) == (
        LocateConfig(),
        AmclConfig(),
        MonitorConfig(),
    )
    with pytest.raises(dataclasses.FrozenInstanceError):
        config.monitor = MonitorConfig()
