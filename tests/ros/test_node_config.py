"""The settings of a node."""

from dataclasses import fields

import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.ros.node_config import Mode, NodeConfig


def test_out_of_the_box_it_helps_the_amcl_that_is_there():
    config = NodeConfig()
    assert config.mode is Mode.BOOTSTRAP
    assert config.yaml_filename == config.saved_pose_file == ""
    assert config.amcl == AmclConfig()


def test_modes_are_the_words_of_the_paper():
    assert {mode.value for mode in Mode} == {"bootstrap", "full"}


def test_every_setting_of_its_own_says_what_it_means():
    for entry in fields(NodeConfig):
        if entry.name != "amcl":
            assert len(entry.metadata["description"]) > 10


@pytest.mark.parametrize(
    "bad",
    [
        {"mode": "full"},
        {"yaml_filename": None},
        {"saved_pose_file": 5},
        {"cloud_rate": -1.0},
        {"cloud_rate": 101.0},
        {"status_rate": 0.0},
    ],
)
def test_what_does_not_fit_is_an_error_of_ours(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        NodeConfig(**bad)


def test_a_cloud_may_be_switched_off():
    assert NodeConfig(cloud_rate=0).cloud_rate == 0.0
