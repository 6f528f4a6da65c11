"""The report of the doctor: packages, caches, a map and ROS."""

import importlib.metadata
import sys
from pathlib import Path

import pytest

from firstfix.amcl import likelihood_field
from firstfix.amcl.config import AmclConfig, SensorModel
from firstfix.cli import doctor
from firstfix.cli.doctor import cache_advice
from firstfix.localizer.precompile import precompile

NO_CACHE = "cannot cache function '_sweep': no matcher available for file 'clearance.py'"


def line(ended, title: str) -> str:
    """Return the line of this title."""
    assert ended.status == 0, ended
    (found,) = [line for line in ended.out.splitlines() if line.startswith(title)]
    return found


@pytest.fixture
def tried_kernels(monkeypatch: pytest.MonkeyPatch):
    """Leave out the kernels, which `test_the_doctor_prints_what_is_installed` runs; give them."""
    original = doctor._tried_kernels
    monkeypatch.setattr(doctor, "_tried_kernels", lambda: "ready")
    return original


pytestmark = pytest.mark.usefixtures("tried_kernels")


@pytest.fixture
def ros_line(cli, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Look at ROS with packages of these names, and these variables."""

    def look(*packages: str, **variables: str) -> str:
        for package in packages:
            (tmp_path / package).mkdir()
            (tmp_path / package / "__init__.py").touch()
        monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
        for name in ("ROS_DISTRO", "AMENT_PREFIX_PATH", *doctor.VARIABLES):
            monkeypatch.delenv(name, raising=False)
        for name, value in variables.items():
            monkeypatch.setenv(name, value)
        return cli("doctor").out.splitlines()[-1]

    return look


def test_ros_2_with_what_it_has(ros_line) -> None:
    line = ros_line("rclpy", "nav2_msgs", ROS_DISTRO="jazzy", AMENT_PREFIX_PATH=sys.prefix)
    assert line.startswith("ROS")
    assert "jazzy, rclpy" in line
    assert "nav2_msgs" in line
    assert "export" not in line


def test_how_ros2_run_finds_the_node(ros_line) -> None:
    line = ros_line("rclpy", ROS_DISTRO="humble", AMENT_PREFIX_PATH="/opt/ros/humble")
    assert f"export AMENT_PREFIX_PATH={sys.prefix}:$AMENT_PREFIX_PATH" in line


def test_ros_sourced_for_another_python(ros_line) -> None:
    if importlib.util.find_spec("rospy") is not None:
        pytest.skip("this Python has rospy")
    assert "humble, no client library" in ros_line(ROS_DISTRO="humble")


def test_variables_that_separate_robots_are_printed(ros_line) -> None:
    assert "ROS_DOMAIN_ID=42" in ros_line(ROS_DOMAIN_ID="42")


@pytest.mark.parametrize("uri", ["http://127.0.0.1:1", "http://127.0.0.1:x", "nonsense"])
def test_a_master_that_does_not_answer(ros_line, uri: str) -> None:
    assert f"no master at {uri}" in ros_line("rospy", ROS_MASTER_URI=uri)


@pytest.mark.parametrize(("package", "extra"), [("matplotlib", "plot"), ("cyclonedds", "dds")])
def test_extras_are_named(cli, package: str, extra: str) -> None:
    printed = line(cli("doctor"), package)
    try:
        assert importlib.metadata.version(package) in printed
    except importlib.metadata.PackageNotFoundError:
        assert f"pip install 'firstfix[{extra}]'" in printed


def test_every_package_that_is_needed_is_named() -> None:
    needed = importlib.metadata.requires("firstfix") or []
    names = {need.split(">")[0] for need in needed if "extra ==" not in need}
    assert names <= set(doctor.PACKAGES)


def test_a_map_that_can_be_used(cli, unique: tuple[Path, Path]) -> None:
    assert "10.0 x 8.0 m, " in line(cli("doctor", unique[0]), "map")


def test_a_map_that_cannot(cli) -> None:
    ended = cli("doctor", "nowhere.yaml")
    assert ended.status == 2
    assert ended.err.startswith("firstfix: expected ")


def test_a_cache_that_cannot_be_written(cli, monkeypatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert "cannot be written" in line(cli("doctor"), "cache")


def test_kernels_that_cannot_be_kept(cli, monkeypatch) -> None:
    def raising() -> str:
        raise RuntimeError(NO_CACHE)

    monkeypatch.setattr(doctor, "_tried_kernels", raising)
    ended = cli("doctor")
    assert ended.status == 1
    assert "set NUMBA_CACHE_DIR" in ended.out


def test_any_command_prints_the_advice(cli, monkeypatch) -> None:
    def raising(_path: Path) -> str:
        raise RuntimeError(NO_CACHE)

    monkeypatch.setattr(doctor, "_map", raising)
    ended = cli("doctor", "map.yaml")
    assert ended.status == 2
    assert ended.err.startswith("firstfix: expected ")
    assert "set NUMBA_CACHE_DIR" in ended.err


def test_other_errors_stay_what_they_are() -> None:
    assert cache_advice(RuntimeError("anything else")) is None


def test_the_kernels_of_nodes_are_compiled(monkeypatch, tried_kernels) -> None:
    """Those of every sensor model, with the one that skips beams."""
    asked = []
    monkeypatch.setattr("firstfix.localizer.precompile.precompile", asked.append)
    tried_kernels()
    assert {config.laser_model_type for config in asked} == set(SensorModel)
    assert all(config.do_beamskip for config in asked)


@pytest.mark.slow
def test_beam_skipping_compiles_its_kernel() -> None:
    precompile(AmclConfig(laser_model_type=SensorModel.LIKELIHOOD_FIELD_PROB, do_beamskip=True))
    assert likelihood_field._count_values.signatures
