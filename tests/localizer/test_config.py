"""Settings: the defaults make sense together, nonsense is refused by name."""

from __future__ import annotations

import dataclasses
import math

import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.global_localization.config import LocateConfig
from firstfix.localizer.config import LocalizerConfig, WatchConfig

NAMES = [field.name for field in dataclasses.fields(WatchConfig)]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [0, -1, -0.5, math.nan, math.inf])
def test_what_is_not_positive_is_refused_by_name(name, value):
    with pytest.raises(InputError, match=f"expected {name} above 0, received {value}"):
        WatchConfig(**{name: value})


def test_a_doubt_comes_before_a_contradiction():
    config = WatchConfig()
    assert config.doubtful_cost < config.impossible_cost
    assert config.confirmations >= 2  # one scan alone moves nobody
    assert config.won_looks >= 2
    # A place that is looked at again must be able to be another place.
    assert config.look_again_m <= config.agree_m
    assert config.search_period_s < config.lost_after_s


def test_every_setting_is_described():
    for name in NAMES:
        assert name in (WatchConfig.__doc__ or "")


def test_the_tree_holds_the_defaults_of_its_parts_and_no_two_share_one():
    config = LocalizerConfig()
    assert (config.locate, config.amcl, config.watch) == (
        LocateConfig(),
        AmclConfig(),
        WatchConfig(),
    )
    with pytest.raises(dataclasses.FrozenInstanceError):
        config.watch = WatchConfig()
