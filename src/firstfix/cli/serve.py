"""``firstfix serve``: the live page and the HTTP API of a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.worlds import world_or_map

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid

PORT = 8642


def serve(
    map_: Annotated[str, typer.Argument(metavar="MAP", help="The map's YAML.")],
    port: Annotated[int, typer.Option(help="0: any that is free.", min=0, max=65535)] = PORT,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated robot.")] = 1,
) -> None:
    """Show where a robot is, and why, on a page; answer programs that ask where they are."""
    play_live(world_or_map(map_), map_, seed, port)


def play_live(grid: OccupancyGrid, name: str, seed: int, port: int) -> None:
    """Serve the page of a simulated robot until somebody ends it."""
    import socket

    from firstfix.adapters.node import Node
    from firstfix.adapters.quiet import Quiet
    from firstfix.adapters.sim_robot import RealTime, SimRobot
    from firstfix.adapters.web.feed import Feed
    from firstfix.adapters.web.server import Page, make_app
    from firstfix.adapters.web.server import serve as run
    from firstfix.adapters.web.steering import Steering
    from firstfix.sim.stage import Moment
    from firstfix.system.inputs import NewMap
    from firstfix.system.node_config import Mode, NodeConfig

    listening = socket.create_server(("127.0.0.1", port))
    feed = Feed(name)
    node = Node(NodeConfig(mode=Mode.FULL), Quiet(lambda text: feed.tell("warning", text)), [feed])
    robot = SimRobot(grid, seed)

    def tell(moment: Moment) -> None:
        feed.know(moment.T_map_base)
        for event in moment.events:
            node.give(event)

    node.give(NewMap(0.0, grid))
    node.start()
    living = RealTime(robot, tell)
    living.start()
    typer.echo(f"Live page  http://127.0.0.1:{listening.getsockname()[1]}/  (Ctrl-C ends)")
    run(make_app(Page("sim", feed, Steering(feed, node.give, robot))), listening)
    living.stop()
    node.stop()
