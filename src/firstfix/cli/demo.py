"""``firstfix demo``: a robot is found, tracked, carried away and found again."""

from __future__ import annotations

import json
import math
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import working
from firstfix.cli.serve import PORT, Address, Building, Rest, serve_simulated
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firstfix.core.grid import OccupancyGrid
    from firstfix.lab.scenarios.demo import DemoStep, Episode

FAILED = 1

_EPISODES = (
    "The robot wakes up at {pose}. It does not know this.",
    "A person carries it to {pose}. The wheel-drop sensors report that it was lifted.",
    "It is teleported to {pose}, and no sensor reports it.",
)


def demo(
    world: Annotated[
        str,
        typer.Option(
            metavar="NAME|MAP.yaml",
            help="office, warehouse, house, corridor, rooms, hotel, or a map of your own.",
        ),
    ] = "office",
    seed: Annotated[int, typer.Option(min=0, help="Of places, noise and wheel slip.")] = 1,
    headless: Annotated[
        bool, typer.Option("--headless", help="Run a fixed scenario in the terminal instead.")
    ] = False,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of the page; 0: any.")] = PORT,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="With --headless, the picture: .png, .svg or .pdf.",
            show_default="firstfix-demo.png",
        ),
    ] = None,
    as_object: Annotated[
        bool, typer.Option("--json", help="With --headless, print one JSON object.")
    ] = False,
) -> None:
    """Simulate a Kobuki that wakes up at an unknown place of a building, and localize it.

    The live page shows how it is found without motion and tracked while it drives. There you can
    set goals, carry it elsewhere, or let people walk around it.

    With `--headless` a fixed scenario runs in the terminal: the robot is found, drives, is carried
    away, drives, and is teleported. Exit status 0 if every answer was correct, 1 if the robot was
    not found, found at a wrong place, or lost. Where places are identical, as in `rooms`, the
    correct answer is AMBIGUOUS.
    """
    from firstfix.lab.worlds.catalog import world_or_map
    from firstfix.plots.figure import check_path

    picture = plot or Path("firstfix-demo.png")
    check_path(picture)
    if not headless and (plot is not None or as_object):
        raise InputError(
            f"{'--json' if plot is None else f'--plot {plot}'} is of the fixed scenario. Add "
            "--headless."
        )
    grid = world_or_map(world)
    if headless:
        _report(grid, world, _played(grid, seed), picture, as_object=as_object)
    else:
        typer.echo(_building(world, grid))
        building = Building(grid, Path(world).stem)
        serve_simulated(building, seed, Address("127.0.0.1", port), Rest.SLEEPS)


def _building(world: str, grid: OccupancyGrid) -> str:
    size = f"{grid.width * grid.resolution:.0f} x {grid.height * grid.resolution:.0f} m"
    return f"Building   {world}: {size}, {grid.free_area:.0f} m² free"


def _played(grid: OccupancyGrid, seed: int) -> list[DemoStep]:
    from firstfix.lab.scenarios.demo import run_demo
    from firstfix.localizer.localizer import Localizer
    from firstfix.localizer.precompile import precompile

    with working("compiling the kernels"):
        precompile()
    with working("simulating the robot"):
        return list(run_demo(grid, seed, Localizer()))


def _report(
    grid: OccupancyGrid, world: str, steps: list[DemoStep], plot: Path, *, as_object: bool
) -> None:
    from firstfix.lab.reports.demo_document import demo_document
    from firstfix.lab.reports.scenario_picture import draw_scenario
    from firstfix.lab.scenarios.demo import summarize_episodes
    from firstfix.plots.figure import can_draw

    episodes = summarize_episodes(steps)
    picture = draw_scenario(grid, steps, plot) if can_draw() else None
    document = demo_document(world, episodes, steps, picture)
    if as_object:
        typer.echo(json.dumps(document, allow_nan=False))
    else:
        typer.echo(_building(world, grid))
        for line in _story(world, episodes, steps, picture):
            typer.echo(line)
    if not document["succeeded"]:
        raise typer.Exit(FAILED)


def _story(
    world: str, episodes: list[Episode], steps: list[DemoStep], picture: Path | None
) -> Iterator[str]:
    """Yield the demo in words."""
    places = "identical rooms" if world == "rooms" else "places fit equally well"
    for number, (episode, words) in enumerate(zip(episodes, _EPISODES, strict=False), 1):
        yield f"\n{number}. {_opening(episode, words)}"
        yield from (f"   {line}" for line in _episode_lines(episode, places))
    yield f"\nCPU        {_cpu_text(steps)}"
    missing = "none, because matplotlib is missing: pip install 'firstfix[plot]'"
    yield f"Picture    {picture or missing}"
    program = "firstfix" if shutil.which("firstfix") else f"{Path(sys.executable).name} -m firstfix"
    yield f"Live page  run `{program} demo` and open the address that it prints"
    succeeded = all(episode.is_tracked or episode.is_correctly_ambiguous for episode in episodes)
    colour = typer.colors.GREEN if succeeded else typer.colors.RED
    yield f"Result     {typer.style(_result_text(episodes), fg=colour, bold=True)}"


def _opening(episode: Episode, words: str) -> str:
    from firstfix.lab.reports.text import pose_text

    return words.format(pose=pose_text(episode.truth))


def _episode_lines(episode: Episode, places: str) -> list[str]:
    times = "once" if episode.wrong_finds == 1 else f"{episode.wrong_finds} times"
    wrong = [f"WRONG: found {times} where it was not."] if episode.wrong_finds else []
    if episode.is_correctly_ambiguous:
        equal = episode.equal_places
        share = sum(place.probability for place in equal) / len(equal)
        answer = f"AMBIGUOUS: {len(equal)} {places}, {100 * share:.0f} % each"
        return [f"{answer}; published nothing. Correct."]
    if episode.found_s is None:
        return [*wrong, "Not found. No pose was published."]
    noticed = f"Noticed after {episode.noticed_s:.1f} s. " if episode.noticed_s else ""
    when = "by the first scan" if episode.found_s < 0.05 else f"after {episode.found_s:.1f} s"
    found = (
        f"{noticed}Found {when}, {100 * episode.found_error_m:.1f} cm and "
        f"{episode.found_error_deg:.2f}° from the true pose."
    )
    if math.isnan(episode.kept):
        return [*wrong, found]
    tracked = (
        f"Tracked: {100 * episode.kept:.1f} % of the scans within 0.5 m and 10°, "
        f"error {100 * episode.rmse_m:.1f} cm and {episode.rmse_deg:.2f}° (RMSE)."
    )
    return [*wrong, found, tracked]


def _cpu_text(steps: list[DemoStep]) -> str:
    cpu = sorted(step.cpu_s for step in steps)
    return (
        f"{1e3 * cpu[len(cpu) // 2]:.1f} ms a scan (median), {1e3 * cpu[-1]:.0f} ms at most, "
        f"{100 * sum(cpu) / steps[-1].stamp:.1f} % of one core; {len(steps)} scans in "
        f"{steps[-1].stamp:.0f} s of simulated time"
    )


def _result_text(episodes: list[Episode]) -> str:
    if all(episode.is_tracked for episode in episodes):
        return "found, tracked, carried away and found again, without help."
    if all(episode.is_tracked or episode.is_correctly_ambiguous for episode in episodes):
        return "correct: no pose was published where several places fit equally well."
    return "failed: not every answer was correct."
