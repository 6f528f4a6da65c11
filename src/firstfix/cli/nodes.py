"""``firstfix ros1``, ``ros2`` and ``dds``: the node on a robot."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from itertools import zip_longest
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from firstfix.cli.fleet_options import (
    FleetMaps,
    FleetUrl,
    FleetVersion,
    FleetVersionOption,
    Manufacturer,
    MapId,
    SerialNumber,
    fleet_bridge,
)
from firstfix.cli.site import SiteOption
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.ros.names import Names
    from firstfix.ros.node import MakeNode
    from firstfix.ros.node_config import NodeConfig
    from firstfix.ros.transport import Transport
    from firstfix.vda5050.bridge import Bridge

# What each node needs, and how to come by it.
_VENV = "run firstfix in an environment made by `/usr/bin/python3 -m venv --system-site-packages`"
_NEEDED = {
    "ros1": ("rospy", f"source ROS's setup.bash, or {_VENV}"),
    "ros2": (
        "rclpy",
        f"source /opt/ros/$ROS_DISTRO/setup.bash, and {_VENV}; or try `firstfix dds`",
    ),
    "dds": ("cyclonedds", "pip install 'firstfix[dds]'"),
}

_MODULES = {
    "ros1": "firstfix.ros.ros1.node",
    "ros2": "firstfix.ros.ros2.node",
    "dds": "firstfix.ros.dds.participant",
}

# Whatever follows is for ROS.
PASSED_ON = {"allow_extra_args": True, "ignore_unknown_options": True}
# The same, where it stands after ``--``.
AFTER_DASHES = {"allow_extra_args": True}


def ros1(
    context: typer.Context,
    site: SiteOption = None,
    vda5050: FleetUrl = None,
    manufacturer: Manufacturer = None,
    serial_number: SerialNumber = None,
    map_id: MapId = None,
    vda5050_map: FleetMaps = None,
    vda5050_version: FleetVersionOption = FleetVersion.V2,
) -> None:
    """Run the node for ROS 1: it finds the robot, and starts AMCL or tracks the robot itself.

    Arguments are those of rosrun: `scan:=base_scan _mode:=full _base_frame_id:=base_link`.
    """
    adapter = _load("ros1")
    with fleet_bridge(
        vda5050, manufacturer, serial_number, map_id, vda5050_map, vda5050_version, site
    ) as bridge:
        adapter.run([*context.args, *_for_ros1(own_site(site))], _maker(bridge))


def ros2(
    context: typer.Context,
    site: SiteOption = None,
    vda5050: FleetUrl = None,
    manufacturer: Manufacturer = None,
    serial_number: SerialNumber = None,
    map_id: MapId = None,
    vda5050_map: FleetMaps = None,
    vda5050_version: FleetVersionOption = FleetVersion.V2,
) -> None:
    """Run the node for ROS 2, a lifecycle node: configure and activate it, or let it do so itself.

    Arguments are those of `ros2 run`: `--ros-args -r scan:=base_scan -p mode:=full
    -p autostart:=true`.
    """
    adapter = _load("ros2")
    with fleet_bridge(
        vda5050, manufacturer, serial_number, map_id, vda5050_map, vda5050_version, site
    ) as bridge:
        adapter.run([*context.args, *_for_ros2(own_site(site))], _maker(bridge))


def dds(
    map_file: Annotated[
        Path | None, typer.Option("--map", help="Map to load; without it, the topic `map`.")
    ] = None,
    site: SiteOption = None,
    mode: Annotated[
        str | None,
        typer.Option(help="`bootstrap`: find the robot and start an AMCL; `full`: also track it."),
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
    vda5050: FleetUrl = None,
    manufacturer: Manufacturer = None,
    serial_number: SerialNumber = None,
    map_id: MapId = None,
    vda5050_map: FleetMaps = None,
    vda5050_version: FleetVersionOption = FleetVersion.V2,
) -> None:
    """Run the node for ROS 2 where no ROS is installed, as a participant of DDS.

    The variables of ROS 2 count: `ROS_DOMAIN_ID`, `ROS_DISTRO`, `ROS_LOCALHOST_ONLY`,
    `ROS_AUTOMATIC_DISCOVERY_RANGE`, `ROS_STATIC_PEERS`; and `CYCLONEDDS_URI`.
    """
    adapter = _load("dds")
    from firstfix.ros.arguments import names_from, settings_from

    names = names_from(remap or [], name, namespace)
    options: dict[str, Any] = {"mode": mode, "base_frame_id": base_frame, **own_site(site)}
    options["yaml_filename"] = None if map_file is None else str(map_file)
    config = settings_from(
        node=names.node,
        amcl_file=params,
        files=params_file or [],
        assignments=param or [],
        options=options,
    )
    with fleet_bridge(
        vda5050, manufacturer, serial_number, map_id, vda5050_map, vda5050_version, site
    ) as bridge:
        adapter.run(config, names, _maker(bridge))


def runner(robot: str) -> Callable[[dict[str, str], list[str], MakeNode], None]:
    """Return a function that runs a node: parameters, arguments of ROS, factory of the node.

    Raises
    ------
    InputError
        If the client library of that ROS is missing.
    """
    adapter = _load(robot)

    def run(own: dict[str, str], arguments: list[str], make_node: MakeNode) -> None:
        if robot == "ros1":
            adapter.run([*arguments, *_for_ros1(own)], make_node)
        elif robot == "ros2":
            adapter.run([*arguments, *_for_ros2({**own, "autostart": "true"})], make_node)
        else:
            adapter.run(*_settings_of(arguments, own), make_node)

    return run


def _settings_of(arguments: list[str], own: dict[str, str]) -> tuple[NodeConfig, Names]:
    """Read what follows ``--ros-args`` where no ROS reads it."""
    from firstfix.ros.arguments import names_from, settings_from

    values: dict[str, list[str]] = {"-r": [], "-p": [], "--params-file": []}
    rest = [argument for argument in arguments if argument != "--ros-args"]
    for flag, value in zip_longest(rest[::2], rest[1::2]):
        if flag not in values or value is None:
            raise InputError(
                expected="arguments like -r scan:=front/scan -p mode:=full",
                received=f"{flag}",
                remedy=f"write {', '.join(values)}, each with a value",
            )
        values[flag].append(value)
    names = names_from(values["-r"], "firstfix", "/")
    config = settings_from(
        node=names.node,
        amcl_file=None,
        files=[Path(file) for file in values["--params-file"]],
        assignments=values["-p"],
        options=own,
    )
    return config, names


def own_site(path: Path | None) -> dict[str, str]:
    """Return the parameter of a node that ``--site`` sets; ROS may start it in another folder."""
    return {} if path is None else {"site": f"{path.resolve()}"}


def _for_ros1(own: dict[str, str]) -> list[str]:
    return [f"_{name}:={value}" for name, value in own.items()]


def _for_ros2(own: dict[str, str]) -> list[str]:
    given = [word for name, value in own.items() for word in ("-p", f"{name}:={value}")]
    return ["--ros-args", *given] if given else []


def _maker(bridge: Bridge | None) -> MakeNode:
    """Return a factory of nodes that the bridge, if there is one, watches."""
    from firstfix.ros.node import Node

    def make(config: NodeConfig, transport: Transport) -> Node:
        node = Node(config, transport, [] if bridge is None else [bridge])
        if bridge is not None:
            bridge.attach(node.give)
        return node

    return make


def _load(name: str) -> ModuleType:
    library, remedy = _NEEDED[name]
    expected = f"{library} in this Python"
    try:
        importlib.import_module(library)
        expected, remedy = f"all modules of the node for {name}", "install it"
        return importlib.import_module(_MODULES[name])
    except ModuleNotFoundError as error:
        raise InputError(
            expected=expected, received=f"no module {error.name}", remedy=remedy
        ) from error
