"""What the doctor says of ROS."""

import importlib.metadata
import sys
from pathlib import Path

import pytest


@pytest.fixture
def ros_line(cli, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Look at ROS with packages of these names, and these variables."""

    def look(*packages: str, **variables: str) -> str:
        for package in packages:
            (tmp_path / package).mkdir()
            (tmp_path / package / "__init__.py").touch()
        monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
        for name in ("ROS_DISTRO", "AMENT_PREFIX_PATH"):
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


def test_dds_is_named(cli) -> None:
    (line,) = [line for line in cli("doctor").out.splitlines() if line.startswith("cyclonedds")]
    try:
        assert importlib.metadata.version("cyclonedds") in line
    except importlib.metadata.PackageNotFoundError:
        assert "pip install 'firstfix[dds]'" in line
