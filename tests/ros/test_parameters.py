"""Settings as the flat parameters of ROS, and back."""

import math
from dataclasses import fields
from enum import Enum
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.belief.config import BeliefConfig
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import LocateConfig
from firstfix.io.parameters.amcl_yaml import IGNORED
from firstfix.io.parameters.ros1_amcl import GONE, NEW_NAMES
from firstfix.localizer.config import ChangesConfig, MonitorConfig, ScansConfig
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.parameters import Parameter, configured, flattened, load_node_config, parameters

BY_NAME = {parameter.name: parameter for parameter in parameters()}
WITHOUT_EFFECT = ("recovery_alpha_slow", "recovery_alpha_fast", "locate.hypotheses")


def test_every_setting_is_a_parameter_and_every_parameter_a_setting():
    expected = {entry.name for owner in (NodeConfig, AmclConfig) for entry in fields(owner)}
    expected |= {f"locate.{entry.name}" for entry in fields(LocateConfig)}
    expected |= {f"monitor.{entry.name}" for entry in fields(MonitorConfig)}
    expected |= {f"belief.{entry.name}" for entry in fields(BeliefConfig)}
    expected |= {entry.name for entry in fields(ScansConfig)}
    expected |= {f"changes.{entry.name}" for entry in fields(ChangesConfig)}
    expected -= {"localizer", "initial_pose"}
    expected |= {"initial_pose.x", "initial_pose.y", "initial_pose.yaw"}
    assert set(BY_NAME) == expected
    assert len(parameters()) == len(expected)


def test_no_setting_of_the_node_hides_one_of_amcl():
    own, amcl = ({entry.name for entry in fields(owner)} for owner in (NodeConfig, AmclConfig))
    assert not own & amcl


def test_defaults_make_default_settings():
    assert configured({}) == NodeConfig()
    assert configured({p.name: p.default for p in parameters()}) == NodeConfig()


def test_every_parameter_has_type_meaning_and_range():
    for parameter in parameters():
        assert type(parameter.default) in (bool, int, float, str)
        assert parameter.description
        assert parameter.least <= parameter.most
        if type(parameter.default) in (int, float):
            assert parameter.least <= parameter.default <= parameter.most


def test_choices_are_listed():
    choices = {parameter.name: parameter.choices for parameter in parameters() if parameter.choices}
    assert choices == {
        "mode": ("bootstrap", "full"),
        "robot_model_type": tuple(model.value for model in MotionModel),
        "laser_model_type": tuple(model.value for model in SensorModel),
    }


# Texts that mean numbers, and one that needs a map file.
TEXTS = {
    "height_band": ("0.1 1.8", "0 2"),
    "laser_pose": ("", "a=1,0,0 b=0,0,0,3.14"),
    "zones": ("",),
    # Not with a map file, nor with changes of one map; the service only with a site.
    "site": ("",),
    "load_map_service": ("",),
}


def fitting(parameter: Parameter):
    if parameter.choices:
        return st.sampled_from(parameter.choices)
    kind = type(parameter.default)
    if kind is bool:
        return st.booleans()
    if parameter.name in TEXTS:
        return st.sampled_from(TEXTS[parameter.name])
    if kind is str:
        return st.text("abc/_", min_size=1).filter(lambda text: text != "/")
    low, high = max(parameter.least, -1e6), min(parameter.most, 1e6)
    return st.integers(int(low), int(high)) if kind is int else st.floats(low, high)


@given(st.data())
def test_valid_values_reach_the_config(data):
    names = data.draw(st.lists(st.sampled_from(sorted(BY_NAME)), unique=True, max_size=5))
    values = {name: data.draw(fitting(BY_NAME[name])) for name in names}
    assume(values.get("min_particles", 500) <= values.get("max_particles", 2000))
    assume(not set(values) & set(WITHOUT_EFFECT))
    config = configured(values)
    for name, value in values.items():
        section, _, short = name.rpartition(".")
        if section == "initial_pose":
            got = getattr(config.initial_pose, short)
            assert math.isclose(math.cos(got), math.cos(value), abs_tol=1e-9)
            continue
        owner = getattr(config.localizer, section or ("scans" if name == "deskew" else "amcl"))
        got = getattr(config if hasattr(config, name) else owner, short)
        is_frame = name.endswith(("_frame_id", "_frame"))
        expected = value.removeprefix("/") if is_frame else value
        assert (got.value if isinstance(got, Enum) else got) == expected


def test_a_pose_has_three_parts_and_nav2s_z():
    values = {"x": 1, "y": -2.5, "z": 7.0, "yaw": 0.5}
    config = configured(flattened({"initial_pose": values}))
    assert config.initial_pose == SE2(1.0, -2.5, 0.5)


@pytest.mark.parametrize("name", WITHOUT_EFFECT)
def test_parameters_without_effect_in_a_node_are_refused_with_the_reason(name):
    with pytest.raises(InputError, match=rf"{name} of {BY_NAME[name].default}: a node .*; remove"):
        configured({name: 1})
    assert configured({name: BY_NAME[name].default}) == NodeConfig()


def test_search_and_monitor_can_be_configured_on_a_robot():
    values = {
        "locate.max_poses": 10**6,
        "locate.unique_probability": 0.9,
        "monitor.lost_after_s": 5.0,
    }
    localizer = configured(values).localizer
    assert localizer.locate == LocateConfig(max_poses=10**6, unique_probability=0.9)
    assert localizer.monitor == MonitorConfig(lost_after_s=5.0)


def test_frames_lose_the_slash_of_old_ros():
    config = configured({"odom_frame_id": "/odom", "base_frame_id": "robot1/base_link"})
    assert (config.odom_frame_id, config.base_frame_id) == ("odom", "robot1/base_link")


def test_modes_and_models_are_words():
    config = configured(
        {"mode": "full", "laser_model_type": "beam", "robot_model_type": "stationary"}
    )
    assert config.mode is Mode.FULL
    assert config.localizer.amcl.laser_model_type is SensorModel.BEAM
    assert config.localizer.amcl.robot_model_type is MotionModel.STATIONARY


def test_models_of_nav2_until_foxy_are_known_as_in_a_file():
    config = configured({"robot_model_type": "omnidirectional"})
    assert config.localizer.amcl.robot_model_type is MotionModel.OMNIDIRECTIONAL


def test_parameters_of_every_node_are_ignored():
    values = dict.fromkeys(IGNORED, "anything") | {"qos_overrides./tf.publisher.depth": 5}
    assert configured(values) == NodeConfig()


@pytest.mark.parametrize("name", sorted(NEW_NAMES | dict.fromkeys(GONE)))
def test_names_of_ros_1_come_with_their_remedy(name):
    with pytest.raises(InputError, match=r"Nav2|only AMCL for ROS 1") as caught:
        configured({name: 0.5})
    if name in NEW_NAMES:
        assert NEW_NAMES[name] in str(caught.value)


def test_the_error_of_a_misspelled_name_suggests_the_right_one():
    with pytest.raises(InputError, match="received max_particle; the nearest is max_particles"):
        configured({"max_particle": 100})
    with pytest.raises(InputError, match="received zzzz; remove it"):
        configured({"zzzz": 1})


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        (
            "mode",
            "boot",
            "mode as one of bootstrap, full, received 'boot'; the default is bootstrap",
        ),
        ("mode", 1, "one of bootstrap, full"),
        ("mode", ["full"], "one of bootstrap, full"),
        ("laser_model_type", "Beam", "likelihood_field, likelihood_field_prob, beam"),
        ("max_beams", 60.0, "whole number"),
        ("max_beams", "60", "whole number"),
        ("max_beams", 1, "at least 2"),
        ("tf_broadcast", 1, "true or false"),
        ("alpha1", "0.2", "a number"),
        ("alpha1", None, "a number"),
        ("alpha1", math.nan, "a number"),
        ("scan_topic", "", "a text"),
        ("scan_topic", 5, "a text"),
        ("height_band", "0.1", "two heights"),
        ("height_band", [1.8, 0.1], "is empty"),
        ("laser_pose", "1,2", "is not a pose"),
        ("laser_pose", "0,0,0,1.57", "level"),
        ("zones", "hall", "yaml_filename is empty"),
        ("scan_topics", {"a": 1}, "a text"),
        ("base_frame_id", "/", "a text"),
        ("base_frame_id", 5, "a text"),
        ("initial_pose.x", "1", "initial_pose.x as a number"),
        ("initial_pose.x", True, "initial_pose.x as a number"),
        ("initial_pose.yaw", math.inf, "initial_pose.yaw as a number"),
        ("initial_pose.y", math.nan, "initial_pose.y as a number"),
        ("initial_pose.y", 10**400, "initial_pose.y as a number"),
        ("initial_pose.z", "high", "initial_pose.z as a number"),
        ("initial_pose", 1.0, "initial_pose"),
    ],
)
def test_invalid_values_are_reported_with_the_remedy(name, value, words):
    with pytest.raises(InputError, match=words):
        configured({name: value})


ANYTHING = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.lists(st.integers(), max_size=2)
    | st.binary(max_size=3)
)
NAMES = st.text(max_size=8) | st.sampled_from([*BY_NAME, *NEW_NAMES, "initial_pose", "amcl"])


@given(st.dictionaries(NAMES, ANYTHING, max_size=3))
def test_any_file_gives_settings_or_an_error_of_ours(values):
    try:
        config = configured(values)
    except InputError:
        return
    assert isinstance(config, NodeConfig)


@given(
    st.recursive(
        ANYTHING, lambda inner: st.dictionaries(st.text("abc", max_size=2), inner, max_size=3)
    )
)
def test_flat_names_lead_to_the_values_of_the_tree(tree):
    tree = {"root": tree}
    for name, value in flattened(tree).items():
        at = tree
        parts = name.split(".")
        for part in parts:
            at = at[part]
        assert at is value
        assert not isinstance(value, dict)


def test_parameters_have_the_meaning_of_those_in_a_file(tmp_path: Path):
    """One YAML for the node and for `firstfix track --params`."""
    text = (
        "alpha1: 0.3\nmax_beams: 90\nrobot_model_type: differential\ntf_broadcast: false\n"
        "base_frame_id: base_link\ninitial_pose: {x: 1.0, y: 2.0, z: 0.0, yaw: 0.5}\n"
    )
    file = tmp_path / "amcl.yaml"
    file.write_text(text)
    values = {
        "alpha1": 0.3,
        "max_beams": 90,
        "robot_model_type": "differential",
        "tf_broadcast": False,
        "base_frame_id": "base_link",
        "initial_pose": {"x": 1.0, "y": 2.0, "z": 0.0, "yaw": 0.5},
    }
    assert configured(flattened(values)) == load_node_config(file)
