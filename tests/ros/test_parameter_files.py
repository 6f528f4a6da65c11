"""A file of Nav2 becomes the same settings; everything else is rejected with a remedy."""

from dataclasses import fields
from enum import Enum

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.io.parameters.amcl_yaml import IGNORED
from firstfix.localizer.config import LocalizerConfig
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.parameters import defaults, load_node_config

# As `ros2 param dump /amcl` writes it, values changed.
DUMP = """
/amcl:
  ros__parameters:
    alpha1: 0.1
    alpha2: 1.0e-2
    alpha3: 1
    base_frame_id: base_link
    do_beamskip: true
    freespace_downsampling: false
    initial_pose:
      x: 1.5
      y: -2
      yaw: 0.5
      z: 0.0
    introspection_mode: disabled
    laser_model_type: likelihood_field_prob
    max_beams: 60.0
    max_particles: 3000
    odom_frame_id: 'odom'
    qos_overrides:
      /clock:
        subscription:
          depth: 1
          durability: volatile
    random_seed: -1
    robot_model_type: nav2_amcl::OmniMotionModel
    scan_topic: /robot1/scan
    set_initial_pose: True
    start_type_description_service: true
    tf_broadcast: off
    use_sim_time: false
"""


def with_amcl(**values) -> NodeConfig:
    return NodeConfig(localizer=LocalizerConfig(amcl=AmclConfig(**values)))


@pytest.fixture
def load(tmp_path):
    def load(text: str | bytes) -> NodeConfig:
        path = tmp_path / "nav2_params.yaml"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return load_node_config(path)

    return load


def test_a_dump_of_the_node_is_read(load):
    amcl = AmclConfig(
        alpha1=0.1,
        alpha2=0.01,
        alpha3=1.0,
        do_beamskip=True,
        laser_model_type=SensorModel.LIKELIHOOD_FIELD_PROB,
        max_particles=3000,
        robot_model_type=MotionModel.OMNIDIRECTIONAL,
    )
    assert load(DUMP) == NodeConfig(
        localizer=LocalizerConfig(amcl=amcl),
        base_frame_id="base_link",
        initial_pose=SE2(1.5, -2.0, 0.5),
        scan_topic="/robot1/scan",
        set_initial_pose=True,
        tf_broadcast=False,
    )


def test_missing_parameters_have_their_defaults(load):
    assert load("amcl: {ros__parameters: {use_sim_time: true}}") == NodeConfig()


def test_sections_of_other_nodes_are_ignored(load):
    other = "controller_server: {ros__parameters: {alpha1: many, FollowPath: {plugin: x}}}\n"
    assert load(other + "amcl: {ros__parameters: {alpha1: 0.3}}").localizer.amcl.alpha1 == 0.3


@pytest.mark.parametrize(
    "text", ["{initial_pose: {x: 1, yaw: 2}}", "{initial_pose.x: 1, initial_pose.yaw: 2}"]
)
def test_the_initial_pose_nested_or_dotted(load, text):
    assert load(f"amcl: {{ros__parameters: {text}}}").initial_pose == SE2(1.0, 0.0, 2.0)


def test_the_types_are_those_that_kernels_are_compiled_for(load):
    config = load("alpha1: 1\nmax_beams: 30.0\ninitial_pose.x: 1").localizer.amcl
    for entry in fields(AmclConfig):
        assert type(getattr(config, entry.name)) is type(entry.default)


@pytest.mark.parametrize(
    ("value", "model"),
    [
        ("differential", MotionModel.DIFFERENTIAL),
        ("omnidirectional", MotionModel.OMNIDIRECTIONAL),
        ("stationary", MotionModel.STATIONARY),
        ('"nav2_amcl::DifferentialMotionModel"', MotionModel.DIFFERENTIAL),
    ],
)
def test_motion_models_by_all_their_names(load, value, model):
    assert load(f"robot_model_type: {value}").localizer.amcl.robot_model_type is model


def written(value: object) -> object:
    return value.value if isinstance(value, Enum) else value


def test_every_setting_can_be_written_and_read(load):
    known = {name: written(default) for name, default in defaults().items()}
    given_values = {name: value for name, value in known.items() if value != ""}
    assert load(yaml.safe_dump({"amcl": {"ros__parameters": given_values}})) == NodeConfig()


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "alpha1": st.floats(0.0, 1e6),
            "sigma_hit": st.floats(1e-3, 1e6),
            "max_beams": st.integers(2, 1000),
            "random_seed": st.integers(-1, 2**53),
            "do_beamskip": st.booleans(),
            "laser_model_type": st.sampled_from(SensorModel),
        },
    )
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_written_settings_are_read_unchanged(load, given_values):
    text = "".join(f"    {k}: {written(v)!r}\n" for k, v in given_values.items())
    assert load(f"amcl:\n  ros__parameters:\n    use_sim_time: true\n{text}") == with_amcl(
        **given_values
    )


@pytest.mark.parametrize("name", sorted(IGNORED))
def test_ignored_parameters_may_have_any_value(load, name):
    assert load(f"alpha1: 0.2\n{name}: [1, {{a: b}}]\n") == NodeConfig()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("alpa1: 0.2", "received 'alpa1'; the nearest is alpha1"),
        ("max_beam: 30", "the nearest is max_beams"),
        ("initial_pose: {z: 0, yaww: 1}", r"the nearest is initial_pose\.yaw"),
        ("use_simtime: true", "the nearest is use_sim_time"),
        ("xyzzy: 1", "delete the line"),
        ("initial_pose: [1, 2, 0]", "'initial_pose: {x: 0.0"),
        ("kld_err: 0.05", "Nav2 calls it pf_err"),
        ("laser_max_beams: 30", "Nav2 calls it max_beams"),
        ("odom_model_type: omni", "'robot_model_type: nav2_amcl::OmniMotionModel'"),
        ("odom_model_type: [diff]", "robot_model_type"),
        ("odom_alpha1: 0.2", "Nav2 calls it alpha1; a value tuned"),
        ("alpha1: x", "alpha1 as a finite number .* received 'x'; write it like 'alpha1: 0.2'"),
        ("alpha1: .nan", "alpha1 as a finite number"),
        ("alpha1: 1e999", "alpha1 as a finite number"),
        ("alpha1: true", "alpha1 as a finite number"),
        ("alpha1: '0.2'", "received '0.2'; write it like 'alpha1: 0.2', without quotes"),
        ("alpha1:", "received nothing"),
        ("alpha1: [0.2]", "received a list"),
        ("alpha1: !!python/object/apply:os.getcwd []", "plain YAML"),
        ("alpha1: !number 0.2", "plain YAML .*'!number'"),
        ("alpha1: $(var alpha)", "alpha1 as a finite number"),
        ("alpha1: -1", "alpha1 .* of at least 0"),
        ("z_hit: 2", "z_hit .* at most 1"),
        ("max_beams: 60.5", "max_beams as a whole number"),
        ("max_beams: " + "9" * 4000, "max_beams as a whole number"),
        ("max_beams: 1", "max_beams .* of at least 2"),
        ("min_particles: 3000", "min_particles up to max_particles"),
        ("do_beamskip: 1", "do_beamskip as true or false"),
        ("do_beamskip: 'true'", "write it like 'do_beamskip: false', without quotes"),
        ("base_frame_id: 5", "base_frame_id as text"),
        ("base_frame_id: on", "base_frame_id as text"),
        ("base_frame_id: ''", "base_frame_id as text"),
        ("base_frame_id: ~", "received nothing"),
        (
            "robot_model_type: diff",
            "one of nav2_amcl::DifferentialMotionModel, .*, omnidirectional",
        ),
        (
            "laser_model_type: likelyhood_field",
            "one of likelihood_field, likelihood_field_prob, beam",
        ),
    ],
)
def test_invalid_lines_are_rejected_with_a_remedy(load, line, message):
    with pytest.raises(InputError, match=message) as caught:
        load(f"amcl:\n  ros__parameters:\n    use_sim_time: true\n    {line}\n")
    assert "nav2_params.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_without_amcl_lists_what_it_has(load):
    with pytest.raises(InputError, match=r"a section amcl .* only '/map_server, /planner_server'"):
        load("map_server: {ros__parameters: {}}\nplanner_server: {ros__parameters: {}}")


def test_text_that_looks_like_a_number_in_quotes_is_text(load):
    assert load("base_frame_id: '5'").base_frame_id == "5"


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=3), inner, max_size=2)
    ),
    max_leaves=4,
)
NAMES = st.sampled_from([entry.name for entry in fields(AmclConfig)]) | st.text(max_size=5)


@settings(
    max_examples=2 * settings.default.max_examples,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.dictionaries(NAMES, VALUES, max_size=3))
def test_any_values_give_settings_or_one_sentence(load, given_values):
    message = ""
    try:
        load(yaml.safe_dump({"amcl": {"ros__parameters": given_values}}))
    except InputError as error:
        message = str(error)
    assert "\n" not in message
