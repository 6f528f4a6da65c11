"""``firstfix ros1``, ``ros2`` and ``dds``: the node on a robot."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from firstfix.core.errors import InputError

# Whatever follows is for ROS.
PASSED_ON = {"allow_extra_args": True, "ignore_unknown_options": True}


def ros1(context: typer.Context) -> None:
    """Run the node for ROS 1: it finds the robot, and tells AMCL or follows it itself.

    Arguments are those of rosrun: `scan:=base_scan _mode:=full _base_frame_id:=base_link`.
    """
    adapter = _load(
        "ros1",
        "rospy",
        "source ROS's setup.bash, or run firstfix in an environment "
        "made by `/usr/bin/python3 -m venv --system-site-packages`",
    )
    adapter.run(context.args)


def ros2(context: typer.Context) -> None:
    """Run the node for ROS 2, a lifecycle node: configure and activate it, or let it do so itself.

    Arguments are those of `ros2 run`: `--ros-args -r scan:=base_scan -p mode:=full
    -p autostart:=true`.
    """
    adapter = _load(
        "ros2",
        "rclpy",
        "source /opt/ros/$ROS_DISTRO/setup.bash, and run firstfix in an environment "
        "made by `/usr/bin/python3 -m venv --system-site-packages`; or try `firstfix dds`",
    )
    adapter.run(context.args)


def dds(
    map_file: Annotated[
        Path | None, typer.Option("--map", help="Map to load; without it, hear it on `map`.")
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(help="`bootstrap`: find the robot for an AMCL beside; `full`: follow it."),
    ] = None,
    params: Annotated[
        Path | None, typer.Option(help="Parameters of Nav2's AMCL, in its section `amcl`.")
    ] = None,
    base_frame: Annotated[str | None, typer.Option(help="Frame of the base.")] = None,
    name: Annotated[str, typer.Option(help="Name of the node.")] = "firstfix",
    namespace: Annotated[str, typer.Option(help="Where its topics are.")] = "/",
    remap: Annotated[
        list[str] | None, typer.Option("--remap", "-r", help="`scan:=front/scan`, `__ns:=/robot1`")
    ] = None,
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", help="`cloud_rate:=5.0`")
    ] = None,
    params_file: Annotated[
        list[Path] | None, typer.Option(help="Parameters in a section `firstfix` or `/**`.")
    ] = None,
    ros_args: Annotated[  # noqa: ARG001 - ROS writes it before its arguments
        bool, typer.Option("--ros-args", help="As ROS 2 has it; without effect.")
    ] = False,
) -> None:
    """Run the node for ROS 2 where no ROS is installed, as a participant of DDS.

    The variables of ROS 2 count: `ROS_DOMAIN_ID`, `ROS_DISTRO`, `ROS_LOCALHOST_ONLY`,
    `ROS_AUTOMATIC_DISCOVERY_RANGE`, `ROS_STATIC_PEERS`; and `CYCLONEDDS_URI`.
    """
    adapter = _load("dds", "cyclonedds", "pip install 'firstfix[dds]'")
    from firstfix.adapters.ros_arguments import names_from, settings_from

    names = names_from(remap or [], name, namespace)
    options: dict[str, Any] = {"mode": mode, "base_frame_id": base_frame}
    options["yaml_filename"] = None if map_file is None else str(map_file)
    config = settings_from(
        node=names.node,
        amcl_file=params,
        files=params_file or [],
        assignments=param or [],
        options=options,
    )
    adapter.run(config, names)


def _load(name: str, library: str, remedy: str) -> ModuleType:
    try:
        return importlib.import_module(f"firstfix.adapters.{name}")
    except ModuleNotFoundError as error:
        raise InputError(
            expected=f"{library} in this Python",
            received=f"no module {error.name}",
            remedy=remedy,
        ) from error
