"""The live page, served until somebody ends it."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    import socket

    from firstfix.core.grid import OccupancyGrid
    from firstfix.web.access_control import AccessPolicy

PORT = 8642

# What can be guessed is no token.
SHORTEST_TOKEN = 8


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is, and who may see it.

    Parameters
    ----------
    host : str
        Name or address to listen on.
    port : int
        0 for any that is free.
    token : str or None
        What viewers must know.
    may_steer : bool
        False if they may only watch.
    """

    host: str
    port: int
    token: str | None = None
    may_steer: bool = True

    def access(self) -> AccessPolicy:
        """Return what is asked of clients.

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


class Rest(Enum):
    """What a simulated robot does before anybody looks on."""

    AWAKE = "awake"  # it lives
    SLEEPS = "sleeps"  # nobody shall miss how it is found


def serve_simulated(
    grid: OccupancyGrid, name: str, seed: int, address: Address, rest: Rest
) -> None:
    """Serve the page of a simulated robot until it is interrupted.

    Parameters
    ----------
    grid : OccupancyGrid
        The building, and the map of it.
    name : str
        What it is called.
    seed : int
        Where chance begins.
    address : Address
        Where the page is.
    rest : Rest
        What the robot does until the first viewer comes.

    Raises
    ------
    InputError
        If it cannot be served there.
    """
    from firstfix.global_localization.searchable import check_searchable
    from firstfix.lab.live.simulated_node import SimNode
    from firstfix.lab.live.steered_robot import SimRobot
    from firstfix.web.command_executor import CommandExecutor
    from firstfix.web.page import Page
    from firstfix.web.server import listen, make_server
    from firstfix.web.snapshot_store import SnapshotStore

    access = address.access()
    check_searchable(grid)
    with listen(address.host, address.port) as listening:
        store = SnapshotStore(name)

        def complain(text: str) -> None:
            typer.echo(text, err=True)
            store.add_event("warning", text.partition("\n")[0])

        robot = SimRobot(grid, seed)
        if rest is Rest.SLEEPS:
            robot.pause()
        node = SimNode(grid, robot, [store], store.set_truth, complain)
        executor = CommandExecutor(store, node.give, robot)
        page = Page("sim", store, executor, access, on_first_viewer=robot.go_on)
        node.start()
        _tell(listening, access)
        with suppress(KeyboardInterrupt):  # the usual end
            make_server(page).run(sockets=[listening])
        node.stop()


def serve_robot(robot: str, map_path: Path, arguments: list[str], address: Address) -> None:
    """Run the node of a robot until it ends, and serve its page.

    Parameters
    ----------
    robot : str
        ros1, ros2 or dds.
    map_path : Path
        The map's YAML.
    arguments : list of str
        Of ROS.
    address : Address
        Where the page is.

    Raises
    ------
    InputError
        If the map or an argument cannot be used, or the page cannot be served there.
    """
    from firstfix.cli.nodes import runner
    from firstfix.global_localization.searchable import check_searchable
    from firstfix.io.maps.map_server import load_map
    from firstfix.web.background_page import BackgroundPage
    from firstfix.web.server import listen

    access, run = address.access(), runner(robot)
    check_searchable(load_map(map_path))  # what is wrong with it is told before anything is begun
    with listen(address.host, address.port) as listening:
        _tell(listening, access)
        with BackgroundPage(robot, map_path.stem, access, listening) as page:
            run(f"{map_path.resolve()}", arguments, page.make_node)


def _tell(listening: socket.socket, access: AccessPolicy) -> None:
    """Say where the page is, and show it where somebody is there to look at it."""
    from firstfix.web.server import url_of

    url = url_of(listening) + ("" if access.token is None else f"#token={access.token}")
    typer.echo(f"Live page  {url}  (Ctrl-C ends)")
    has_display = sys.platform in {"darwin", "win32"} or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    if has_display and sys.stdout.isatty():
        import webbrowser

        webbrowser.open(url)
