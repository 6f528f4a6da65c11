"""The settings of a node."""

from dataclasses import fields

import pytest

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.config import LocalizerConfig
from firstfix.ros.node_config import Mode, NodeConfig

# nav2_amcl, the defaults in its documentation and its code.
NAV2 = {
    "always_reset_initial_pose": False,
    "base_frame_id": "base_footprint",
    "first_map_only": False,
    "global_frame_id": "map",
    "initial_pose": SE2.identity(),
    "map_topic": "map",
    "odom_frame_id": "odom",
    "save_pose_rate": 0.5,
    "scan_topic": "scan",
    "set_initial_pose": False,
    "tf_broadcast": True,
    "transform_tolerance": 1.0,
}


def test_defaults_assist_the_amcl_that_is_running():
    config = NodeConfig()
    assert config.mode is Mode.BOOTSTRAP
    assert config.yaml_filename == config.saved_pose_file == ""
    assert config.localizer == LocalizerConfig()


def test_names_and_defaults_are_those_of_nav2():
    config = NodeConfig()
    assert {name: getattr(config, name) for name in NAV2} == NAV2


def test_modes_have_these_names():
    assert {mode.value for mode in Mode} == {"bootstrap", "full"}


def test_every_parameter_has_a_description():
    for entry in fields(NodeConfig):
        if entry.name != "localizer":
            assert len(entry.metadata["description"]) > 10


@pytest.mark.parametrize(
    "bad",
    [
        {"mode": "fast"},
        {"yaml_filename": None},
        {"saved_pose_file": 5},
        {"cloud_rate": -1.0},
        {"cloud_rate": 101.0},
        {"status_rate": 0.0},
        {"odom_frame_id": ""},
        {"transform_tolerance": -0.1},
    ],
)
def test_invalid_parameters_are_refused_by_name(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        NodeConfig(**bad)


def test_particle_clouds_can_be_switched_off():
    assert NodeConfig(cloud_rate=0).cloud_rate == 0.0


def test_changes_are_of_one_map():
    with pytest.raises(InputError, match="a site has many"):
        NodeConfig(site="campus", changes_layer="changes.yaml")
