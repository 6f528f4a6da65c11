"""``firstfix serve``: the live page and the HTTP API of a robot."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from firstfix.cli.live import PORT, Address, Rest, serve_robot, serve_simulated
from firstfix.cli.worlds import world_or_map
from firstfix.core.errors import InputError


class Transport(Enum):
    """Which robot is served."""

    SIM = "sim"
    ROS1 = "ros1"
    ROS2 = "ros2"
    DDS = "dds"


def serve(
    context: typer.Context,
    map_: Annotated[
        str, typer.Argument(metavar="MAP", help="The map's YAML; for `sim` also a built-in world.")
    ],
    robot: Annotated[Transport, typer.Option(help="Which robot is in it.")] = Transport.SIM,
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than loopback need a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any that is free.")] = PORT,
    token: Annotated[
        str | None,
        typer.Option(envvar="FIRSTFIX_TOKEN", help="What viewers and programs must know."),
    ] = None,
    read_only: Annotated[
        bool, typer.Option("--read-only", help="Let people watch and ask, not steer.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated robot.")] = 1,
) -> None:
    """Show on a page where a robot is, and why; answer programs that ask where they are.

    `docs/live.md` has the API. What follows `--` goes to ROS: `firstfix serve map.yaml --robot
    ros1 -- scan:=base_scan`.
    """
    address = Address(host, port, token, may_steer=not read_only)
    if robot is Transport.SIM:
        if context.args:
            raise InputError(
                expected="a map, and options",
                received=f"also {context.args[0]}",
                remedy="arguments of ROS go with --robot ros1, ros2 or dds",
            )
        serve_simulated(world_or_map(map_), Path(map_).stem, seed, address, Rest.AWAKE)
    else:
        serve_robot(robot.value, Path(map_), context.args, address)
