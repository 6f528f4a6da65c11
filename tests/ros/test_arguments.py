import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.amcl.config import AmclConfig, MotionModel
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.config import LocalizerConfig
from firstfix.ros.arguments import names_from, settings_from
from firstfix.ros.node_config import Mode, NodeConfig


def settings(assignments=(), files=(), amcl_file=None, **options):
    return settings_from(
        node="firstfix",
        amcl_file=amcl_file,
        files=files,
        assignments=assignments,
        options=options,
    )


@pytest.fixture
def written(tmp_path):
    def write(text: str, name: str = "params.yaml") -> Path:
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        return file

    return write


def test_rules_name_the_node_its_place_and_its_topics():
    names = names_from(["__ns:=/robot1", "__node:=finder", "scan:=front/scan"], "firstfix", "/")
    assert (names.namespace, names.node) == ("/robot1", "finder")
    assert names.resolve("scan") == "/robot1/front/scan"
    assert names_from(["__name:=finder"], "firstfix", "/").node == "finder"


@pytest.mark.parametrize("namespace", ["robot1", "/robot1", "/robot1/"])
def test_slashes_around_a_namespace_may_be_missing(namespace):
    assert names_from([], "firstfix", namespace).namespace == "/robot1"


def test_rules_for_other_nodes_are_ignored():
    names = names_from(["amcl:scan:=a", "firstfix:scan:=b"], "firstfix", "/")
    assert names.resolve("scan") == "/b"


@pytest.mark.parametrize("rule", ["scan", "scan=a", ":=a", "scan:=", ""])
def test_an_invalid_rule_is_refused(rule):
    with pytest.raises(InputError, match="scan:=base_scan"):
        names_from([rule], "firstfix", "/")


def test_nothing_given_leaves_the_defaults():
    assert settings() == NodeConfig()


def test_assignments_have_the_types_of_ros():
    given_so = ["mode:=full", "cloud_rate:=5", "tf_broadcast:=false", "alpha1:=1e-1"]
    given_so += [
        "scan_topic:='7'",
        "initial_pose.yaw:=-.5",
        "max_particles:=900",
        "min_particles:=9",
    ]
    config = settings(given_so)
    assert config.mode is Mode.FULL
    assert config.cloud_rate == 5.0
    assert config.tf_broadcast is False
    assert config.localizer.amcl.alpha1 == 0.1
    assert config.scan_topic == "7"
    assert config.initial_pose == SE2(0.0, 0.0, -0.5)
    assert (config.localizer.amcl.max_particles, config.localizer.amcl.min_particles) == (900, 9)


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ("mod:=full", "nearest is mode"),
        ("mode:=half", "bootstrap, full"),
        ("mode:=[full]", "one value for mode"),
        ("mode:={a: b}", "one value for mode"),
        ("mode:=*full", "plain YAML"),
        ("max_particles:=1.5", "whole number"),
        ("tf_broadcast:='true'", "true or false"),
        ("alpha1:=much", "a number"),
        ("alpha1:=-1", "at least 0"),
        ("cloud_rate", "mode:=full"),
    ],
)
def test_values_of_a_wrong_type_are_refused(assignment, message):
    with pytest.raises(InputError, match=message):
        settings([assignment])


@given(st.text(), st.sampled_from(["mode", "alpha1", "max_beams", "scan_topic", "tf_broadcast"]))
def test_any_value_fits_or_is_an_error(text, name):
    with contextlib.suppress(InputError):
        assert isinstance(settings([f"{name}:={text}"]), NodeConfig)


@pytest.mark.parametrize("section", ["firstfix", "/**", "robot1/firstfix"])
def test_a_file_has_a_section_for_the_node_or_for_all(written, section):
    file = written(
        f"{section}:\n  ros__parameters:\n    use_sim_time: true\n    mode: full\n"
        "    initial_pose: {x: 1.0, y: 2, yaw: 0.5}\n"
    )
    config = settings(files=[file])
    assert config.mode is Mode.FULL
    assert config.initial_pose == SE2(1.0, 2.0, 0.5)


def test_later_arguments_count_more(written):
    amcl = written("amcl:\n  ros__parameters: {max_beams: 30, alpha1: 0.5}\n", "amcl.yaml")
    one = written("firstfix:\n  ros__parameters: {max_beams: 40, cloud_rate: 1.0}\n", "one.yaml")
    two = written("firstfix:\n  ros__parameters: {cloud_rate: 3.0, status_rate: 1.0}\n", "two.yaml")
    config = settings(["status_rate:=9.0", "mode:=full"], [one, two], amcl, mode="bootstrap")
    assert (config.localizer.amcl.alpha1, config.localizer.amcl.max_beams) == (0.5, 40)
    assert (config.cloud_rate, config.status_rate) == (3.0, 9.0)
    assert config.mode is Mode.BOOTSTRAP


def test_all_settings_of_amcl_are_read_from_its_file(written):
    file = written(
        "amcl:\n  ros__parameters:\n    robot_model_type: omnidirectional\n"
        "    set_initial_pose: true\n    initial_pose: {x: 1.0, y: -2.0, yaw: 0.5}\n"
    )
    assert settings(amcl_file=file) == NodeConfig(
        set_initial_pose=True,
        initial_pose=SE2(1.0, -2.0, 0.5),
        localizer=LocalizerConfig(amcl=AmclConfig(robot_model_type=MotionModel.OMNIDIRECTIONAL)),
    )


def test_a_file_of_another_node_is_refused(written):
    with pytest.raises(InputError, match="section firstfix"):
        settings(files=[written("planner:\n  ros__parameters:\n    speed: 1.0\n")])
