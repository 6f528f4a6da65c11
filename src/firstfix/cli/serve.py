"""``firstfix serve``: the live page and the HTTP API of a robot."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
    import socket

    from firstfix.core.grid import OccupancyGrid
    from firstfix.site.site import Site
    from firstfix.vda5050.bridge import Bridge
    from firstfix.web.access_control import AccessPolicy

PORT = 8642
SHORTEST_TOKEN = 8
INTERRUPTED = 130


class Transport(Enum):
    """Which robot is served."""

    SIM = "sim"
    ROS1 = "ros1"
    ROS2 = "ros2"
    DDS = "dds"


class Rest(Enum):
    """What a simulated robot does before the first viewer comes."""

    AWAKE = "awake"
    SLEEPS = "sleeps"  # so that every viewer sees how it is found


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is, and who may use it.

    Parameters
    ----------
    host : str
        Name or address to listen on.
    port : int
        0 for any free port.
    token : str or None
        What clients must send.
    may_steer : bool
        False if clients may only watch.
    """

    host: str
    port: int
    token: str | None = None
    may_steer: bool = True

    def access(self) -> AccessPolicy:
        """Return the rules for clients.

        Raises
        ------
        InputError
            If the token is missing or too short.
        """
        from firstfix.web.access_control import AccessPolicy, is_loopback

        inside = is_loopback(self.host)
        if self.token is None and not inside:
            raise InputError(
                expected=f"a --token, because {self.host} can be reached by other machines",
                received="none",
                remedy="choose one, or leave --host out",
            )
        if self.token is not None and len(self.token) < SHORTEST_TOKEN:
            raise InputError(
                expected=f"a token of at least {SHORTEST_TOKEN} characters",
                received=f"{len(self.token)}",
                remedy="make it longer; only programs and links need to remember it",
            )
        return AccessPolicy(self.token, may_steer=self.may_steer, loopback_only=inside)


def serve(
    context: typer.Context,
    map_: Annotated[
        str | None,
        typer.Argument(metavar="[MAP]", help="YAML of a map; for `sim` also a built-in world."),
    ] = None,
    site: SiteOption = None,
    robot: Annotated[Transport, typer.Option(help="Which robot is served.")] = Transport.SIM,
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than loopback need a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = PORT,
    token: Annotated[
        str | None,
        typer.Option(envvar="FIRSTFIX_TOKEN", help="What viewers and programs must send."),
    ] = None,
    read_only: Annotated[
        bool, typer.Option("--read-only", help="Viewers can watch and ask, but not steer.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated robot.")] = 1,
    keep_changes: Annotated[
        int,
        typer.Option(
            min=0, max=366, metavar="DAYS", help="Count for DAYS what has changed in the map."
        ),
    ] = 0,
    vda5050: FleetUrl = None,
    manufacturer: Manufacturer = None,
    serial_number: SerialNumber = None,
    map_id: MapId = None,
    vda5050_map: FleetMaps = None,
    vda5050_version: FleetVersionOption = FleetVersion.V2,
) -> None:
    """Show the state of a robot on a live page, and answer requests for its pose.

    `docs/live.md` has the API. Arguments after `--` go to ROS: `firstfix serve map.yaml --robot
    ros1 -- scan:=base_scan`.
    """
    address = Address(host, port, token, may_steer=not read_only)
    if context.args and robot is Transport.SIM:
        raise InputError(
            expected="a map, and options",
            received=f"also {context.args[0]}",
            remedy="arguments of ROS go with --robot ros1, ros2 or dds",
        )
    if (map_ is None) is (site is None):
        raise InputError("Give either a map or --site SITE.")
    with fleet_bridge(
        vda5050, manufacturer, serial_number, map_id, vda5050_map, vda5050_version, site
    ) as bridge:
        if robot is Transport.SIM:
            building = _building(map_) if site is None else _buildings(site)
            serve_simulated(building, seed, address, Rest.AWAKE, bridge, keep_changes)
        else:
            kept = ["--ros-args", "-p", f"changes.days_kept:={keep_changes}"]
            arguments = [*context.args, *kept] if keep_changes else context.args
            serve_robot(robot.value, _own_maps(map_, site), arguments, address, bridge)


@dataclass(frozen=True, eq=False, slots=True)
class Building:
    """Where a simulated robot is.

    Parameters
    ----------
    grid : OccupancyGrid
        The building.
    name : str
        Its name.
    site : Site or None
        All maps in which the robot may be; None: only this one.
    """

    grid: OccupancyGrid
    name: str
    site: Site | None = None


def serve_simulated(
    building: Building,
    seed: int,
    address: Address,
    rest: Rest,
    bridge: Bridge | None = None,
    keep_changes: int = 0,
) -> None:
    """Serve the page of a simulated robot in a building until it is interrupted.

    Raises
    ------
    InputError
        If it cannot be served at this address.
    """
    from firstfix.global_localization.searchable import check_searchable
    from firstfix.lab.live.simulated_node import SimulatedNode
    from firstfix.lab.live.simulated_robot import SimulatedRobot
    from firstfix.lab.worlds.catalog import WORLDS
    from firstfix.localizer.config import ChangesConfig, LocalizerConfig
    from firstfix.web.command_executor import CommandExecutor
    from firstfix.web.page import Page
    from firstfix.web.server import listen, make_server
    from firstfix.web.snapshot_store import SnapshotStore

    access, site = address.access(), building.site
    check_searchable(building.grid)
    with listen(address.host, address.port) as listening:
        store = SnapshotStore(building.name if site is None else "")

        def warn(text: str) -> None:
            typer.echo(text, err=True)
            store.add_event("warning", text.partition("\n")[0])

        worlds = WORLDS if site is None else {n: partial(site.grid, n) for n in site.map_ids}
        robot = SimulatedRobot(building.grid, seed, building.name, worlds)
        if rest is Rest.SLEEPS:
            robot.pause()
        watchers = [] if bridge is None else [bridge]
        config = LocalizerConfig(changes=ChangesConfig(days_kept=keep_changes))
        node = SimulatedNode(robot, store, warn, watchers, config, site)
        if bridge is not None:
            bridge.attach(node.give)
        executor = CommandExecutor(store, node.give, robot)
        page = Page(
            "sim",
            store,
            executor,
            access,
            on_first_viewer=robot.resume,
            incidents=lambda: node.incidents,
        )
        node.start()
        announce(listening, access)
        with suppress(KeyboardInterrupt):  # the usual end; some versions of uvicorn raise it
            make_server(page).run(sockets=[listening])
        node.stop()
    raise typer.Exit(INTERRUPTED)


def _building(map_: str | None) -> Building:
    from firstfix.lab.worlds.catalog import world_or_map

    return Building(world_or_map(f"{map_}"), Path(f"{map_}").stem)


def _buildings(path: Path) -> Building:
    """Load a site; the robot begins in its first map that can be used."""
    from firstfix.cli.site import load_site, prepare_site

    site = load_site(path)
    prepare_site(site)
    if not site.map_ids:
        raise InputError(f"No map of {path} can be used. Look at: firstfix site check {path}")
    name = site.map_ids[0]
    return Building(site.grid(name), name, site)


def _own_maps(map_: str | None, site: Path | None) -> dict[str, str]:
    """Return the parameter of a node that names its map or its site, which are checked."""
    from firstfix.cli.nodes import own_site
    from firstfix.cli.site import load_site
    from firstfix.global_localization.searchable import check_searchable
    from firstfix.io.maps.map_server import load_map

    if site is not None:
        load_site(site)
        return own_site(site)
    path = Path(f"{map_}")
    check_searchable(load_map(path))
    return {"yaml_filename": f"{path.resolve()}"}


def serve_robot(
    robot: str,
    own: dict[str, str],
    arguments: list[str],
    address: Address,
    bridge: Bridge | None = None,
) -> None:
    """Run the node of a robot (ros1, ros2, dds) with arguments of ROS, and serve its page.

    Parameters
    ----------
    robot : str
        ros1, ros2 or dds.
    own : dict of str to str
        The parameter ``yaml_filename`` or ``site`` of the node.
    arguments : list of str
        Of ROS.
    address : Address
        Where the page is.
    bridge : Bridge, optional
        To a fleet control.

    Raises
    ------
    InputError
        If an argument cannot be used, or the page cannot be served at this address.
    """
    from firstfix.cli.nodes import runner
    from firstfix.web.background_page import BackgroundPage
    from firstfix.web.server import listen

    access, run = address.access(), runner(robot)
    name = Path(own["yaml_filename"]).stem if "yaml_filename" in own else ""
    with listen(address.host, address.port) as listening:
        announce(listening, access)
        watchers = [] if bridge is None else [bridge]
        with BackgroundPage(robot, name, access, listening, watchers) as page:
            if bridge is not None:
                bridge.attach(page.give)
            run(own, arguments, page.make_node)


def announce(listening: socket.socket, access: AccessPolicy) -> None:
    """Print the address of the page, and open it in a browser if there is a display."""
    from firstfix.web.server import url_of

    url = url_of(listening) + ("" if access.token is None else f"#token={access.token}")
    typer.echo(f"Live page  {url}  (Ctrl-C ends)")
    has_display = sys.platform in {"darwin", "win32"} or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    if has_display and sys.stdout.isatty():
        import webbrowser

        webbrowser.open(url)
