"""``firstfix fleet``: a service for many robots in many maps."""

from __future__ import annotations

import os
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress_of_start
from firstfix.cli.serve import Address
from firstfix.cli.site import SitePath
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.fleet.engine import Engine
    from firstfix.fleet.jobs import ShardedSite

PORT = 8643
MOST_CONNECTIONS = 2048
MB = 1_000_000

fleet_app = typer.Typer(help="A service for many robots in many maps.", no_args_is_help=True)


class EngineName(Enum):
    """Where the maps are searched."""

    LOCAL = "local"
    RAY = "ray"


@fleet_app.callback()
def fleet() -> None:
    """Serve many robots in many maps."""


@fleet_app.command()
def serve(
    site_path: SitePath,
    engine: Annotated[
        EngineName, typer.Option(help="Processes of this machine, or a Ray cluster.")
    ] = EngineName.LOCAL,
    workers: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="By default one for each core.")
    ] = None,
    parts: Annotated[
        int | None,
        typer.Option(min=1, max=10_000, help="Parts of the site; by default of 50 maps or more."),
    ] = None,
    ray_address: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="A running cluster; by default a local one starts."),
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than loopback need a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = PORT,
    token: Annotated[
        str | None, typer.Option(envvar="FIRSTFIX_TOKEN", help="What clients must send.")
    ] = None,
    memory: Annotated[
        int, typer.Option(min=1, metavar="MB", help="Prepared maps held by all workers together.")
    ] = 4000,
    max_waiting: Annotated[
        int, typer.Option(min=1, max=100_000, help="Queries that run or wait.")
    ] = 256,
    max_robots: Annotated[
        int, typer.Option(min=1, max=100_000, help="Robots that are remembered.")
    ] = 1000,
    idle: Annotated[
        float,
        typer.Option(min=1.0, max=1e6, metavar="S", help="When a silent robot is forgotten."),
    ] = 600.0,
) -> None:
    """Answer over HTTP in which map of SITE robots are, and where in it.

    `docs/howto/fleet.md` has the API.
    """
    access = Address(host, port, token).access()
    if ray_address is not None and engine is not EngineName.RAY:
        raise InputError("--ray-address is of no use without --engine ray. Add it.")
    try:
        from firstfix.fleet.app import make_app
    except ModuleNotFoundError as error:
        raise _not_installed(error, "fleet") from error
    from firstfix.fields.cache import cache_folder
    from firstfix.fleet.fleet import Fleet
    from firstfix.fleet.jobs import ShardedSite, parts_for, spread
    from firstfix.fleet.service import FleetConfig, Service
    from firstfix.io.maps.site_yaml import read_site
    from firstfix.web.server import listen, server_of, url_of

    maps, number = read_site(site_path).maps, workers or os.cpu_count() or 1
    parts = parts or parts_for(len(maps), number)
    if number % parts:
        raise InputError(f"{number} workers cannot share {parts} parts. Make it a multiple.")
    shards, copies = spread(maps, parts), number // parts
    # Copies map the same files into memory.
    sharded = ShardedSite(
        site_path.resolve(), shards * copies, cache_folder() / "sites", memory * MB // len(shards)
    )
    with listen(host, port) as listening:
        started = _start(engine, sharded, ray_address)
        service = Service(
            Fleet(started, shards, copies, maps=maps), FleetConfig(max_waiting, max_robots, idle)
        )
        typer.echo(
            f"Fleet service  {url_of(listening)}  {sum(map(len, shards))} maps, "
            f"{len(shards)} parts, {copies} workers for each (Ctrl-C ends)"
        )
        try:
            with (
                progress_of_start(len(maps), "preparing maps") as prepared,
                suppress(KeyboardInterrupt),  # the usual end
            ):
                app = make_app(service, access, prepared)
                server_of(app, MOST_CONNECTIONS).run(sockets=[listening])
        finally:
            started.close()


def _start(name: EngineName, sharded: ShardedSite, ray_address: str | None) -> Engine:
    if name is EngineName.LOCAL:
        from firstfix.fleet.local_engine import LocalEngine

        return LocalEngine(sharded)
    try:
        from firstfix.fleet.ray_engine import RayEngine
    except ModuleNotFoundError as error:
        raise _not_installed(error, "ray") from error
    return RayEngine(sharded, ray_address)


def _not_installed(error: ModuleNotFoundError, extra: str) -> InputError:
    return InputError(
        expected=f"the packages of the extra {extra} in this Python",
        received=f"no module {error.name}",
        remedy=f"pip install 'firstfix[{extra}]'",
    )
