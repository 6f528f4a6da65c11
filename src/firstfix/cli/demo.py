"""``firstfix demo``: a robot wakes up somewhere in a drawn building and finds out where."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import working
from firstfix.core.errors import InputError
from firstfix.global_localization.config import Method

if TYPE_CHECKING:
    from firstfix.core.estimate import LocateResult
    from firstfix.core.grid import OccupancyGrid
    from firstfix.core.scan import LaserScan
    from firstfix.core.se2 import SE2

NOT_FOUND = 1
PLAUSIBLE = 0.05


def demo(
    world: Annotated[
        str,
        typer.Option(
            metavar="NAME|MAP.yaml",
            help="office, rooms, warehouse, house, corridor, or a map of your own.",
        ),
    ] = "office",
    seed: Annotated[int, typer.Option(min=0, help="Another seed, another place.")] = 1,
    headless: Annotated[  # noqa: ARG001 - there is nothing but the story yet
        bool, typer.Option("--headless", help="Tell the story here, and end.")
    ] = False,
    plot: Annotated[
        Path, typer.Option(metavar="FILE", help="Where the picture goes: .png, .svg or .pdf.")
    ] = Path("firstfix-demo.png"),
) -> None:
    """Put a simulated robot at a random place and locate it from one scan, with two methods.

    Exit status 0 if the default method is right: its one place is the true one, or it says that
    several places fit and gives the true one at least 5 %. Else 1.
    """
    from firstfix.evaluation.figure import can_draw, check_path
    from firstfix.evaluation.picture import draw_answer

    check_path(plot)
    grid = _world(world)
    typer.echo(
        f"Building   {world}: {grid.width} x {grid.height} cells of {grid.resolution:g} m, "
        f"{grid.free_area:.0f} m² free"
    )
    truth, scan = _wake_up(grid, seed)
    _tell(grid, scan, truth, Method.PAPER, "the paper's, every 4 x 4 block x 24 headings")
    result = _tell(grid, scan, truth, Method.FAST, "default")
    picture = "none, because matplotlib is missing: pip install 'firstfix[plot]'"
    if can_draw():
        picture = f"{draw_answer(grid, scan, result, plot, truth)}"
    typer.echo(f"\nPicture    {picture}")
    if not _conclude(result, truth):
        raise typer.Exit(NOT_FOUND)


def _world(name: str) -> OccupancyGrid:
    from firstfix.formats.map_server import load_map
    from firstfix.sim.world import WORLDS

    if name in WORLDS:
        return WORLDS[name]()
    if not Path(name).exists():
        raise InputError(
            expected=f"a world ({', '.join(WORLDS)}) or a map's YAML",
            received=f"{name}, which is neither",
            remedy="choose another --world",
        )
    return load_map(Path(name))


def _wake_up(grid: OccupancyGrid, seed: int) -> tuple[SE2, LaserScan]:
    import numpy as np

    from firstfix.cli.answers import pose_text
    from firstfix.sim.lidar import Lidar
    from firstfix.sim.world import random_free_pose

    rng = np.random.default_rng(seed)
    truth = random_free_pose(grid, rng)
    lidar = Lidar(dropout=0.02)
    scan = lidar.scan(grid, truth, rng)
    typer.echo(f"Robot      wakes at {pose_text(truth)}, and does not know it")
    typer.echo(
        f"Scan       {lidar.beams} beams, up to {lidar.range_max:g} m, σ {lidar.sigma_m:g} m; "
        f"{scan.hit.sum()} hit something"
    )
    return truth, scan


def _tell(
    grid: OccupancyGrid, scan: LaserScan, truth: SE2, method: Method, words: str
) -> LocateResult:
    import time

    from firstfix.cli.answers import error_text, pose_text
    from firstfix.global_localization.locate import Locator

    with working("preparing the map"):
        start = time.perf_counter()
        locator = Locator(grid, method=method, cache_dir=None)
        prepared_s = time.perf_counter() - start
        # The first call may compile; the second shows what a running robot sees.
        locator.locate(scan)
        result = locator.locate(scan)
    typer.echo(f"\nMethod     {method.value} ({words}), map prepared in {prepared_s:.2f} s")
    typer.echo(f"           {result.search.poses:,} poses compared in {result.elapsed_s:.3f} s")
    typer.echo(f"           {result.verdict.value}: {result.reason}")
    if result.best is not None:
        typer.echo(f"           best {pose_text(result.best.pose)}")
        typer.echo(f"           {error_text(result.best.pose, truth)} from the truth")
    return result


def _conclude(result: LocateResult, truth: SE2) -> bool:
    from firstfix.core.estimate import Verdict
    from firstfix.evaluation.outcome import judge

    rank = judge(result, truth, index=0, cpu_s=0.0, wall_s=0.0).rank
    if result.verdict is Verdict.UNIQUE and rank == 1:
        typer.echo("The end    found, without moving.")
        return True
    if result.verdict is Verdict.AMBIGUOUS and rank is not None:
        probability = result.hypotheses[rank - 1].probability
        typer.echo(f"The end    the true place is number {rank} of the list, at {probability:.0%}.")
        return probability >= PLAUSIBLE
    typer.echo("The end    not found.")
    return False
