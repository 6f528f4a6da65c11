"""``firstfix demo``: a robot is found, followed, carried away and found again."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.live import PORT, Address, Rest, serve_simulated
from firstfix.cli.progress import working
from firstfix.cli.worlds import world_or_map
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid
    from firstfix.lab.scenarios.episodes import DemoStep, Episode

FAILED = 1


def demo(
    world: Annotated[
        str,
        typer.Option(
            metavar="NAME|MAP.yaml",
            help="office, warehouse, house, corridor, rooms, or a map of your own.",
        ),
    ] = "office",
    seed: Annotated[int, typer.Option(min=0, help="Another seed, another story.")] = 1,
    headless: Annotated[
        bool, typer.Option("--headless", help="Tell a story here instead, and end.")
    ] = False,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of the page; 0: any.")] = PORT,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="With --headless, where the picture goes: .png, .svg or .pdf.",
        ),
    ] = None,
) -> None:
    """Let a simulated Kobuki wake up in a building that it has a map of, and see what happens.

    A page shows it being found without motion, and followed while it drives about. There you can
    send it somewhere, pick it up and put it down elsewhere, or let people get in its way.

    With `--headless` a story is told here: it is found, driven, carried away by somebody, then
    somewhere else all of a sudden, and nothing but its LIDAR can notice. Exit status 0 if all went
    well, 1 if it was not found, found in the wrong place, or lost. In rooms, and mostly in the
    corridor, that is so: these look the same everywhere.
    """
    from firstfix.plots.figure import check_path

    picture = plot or Path("firstfix-demo.png")
    check_path(picture)
    if plot is not None and not headless:
        raise InputError(
            expected="--plot with --headless",
            received=f"--plot {plot} alone",
            remedy="the page is all the picture that there is otherwise",
        )
    grid = world_or_map(world)
    typer.echo(
        f"Building   {world}: {grid.width} x {grid.height} cells of {grid.resolution:g} m, "
        f"{grid.free_area:.0f} m² free"
    )
    if headless:
        _tell_story(grid, seed, picture)
    else:
        serve_simulated(grid, Path(world).stem, seed, Address("127.0.0.1", port), Rest.SLEEPS)


def _tell_story(grid: OccupancyGrid, seed: int, plot: Path) -> None:
    from firstfix.plots.figure import can_draw

    with working("preparing the map"):
        # The kernels too: what they take to compile is no part of the story.
        from firstfix.lab.scenarios.demo_scenario import run_demo, warm_up
        from firstfix.lab.scenarios.episodes import summarize_episodes
        from firstfix.localizer.localizer import Localizer

        warm_up()
    with working("the robot drives, and somebody is up to something"):
        steps = list(run_demo(grid, seed, Localizer()))
    episodes = summarize_episodes(steps)
    for line in _told(steps, episodes):
        typer.echo(line)
    picture = "none, because matplotlib is missing: pip install 'firstfix[plot]'"
    if can_draw():
        from firstfix.lab.reports.scenario_picture import draw_scenario

        picture = f"{draw_scenario(grid, steps, plot)}"
    typer.echo(f"Picture    {picture}")
    if not all(episode.went_well for episode in episodes):
        typer.echo("The end    not all went well.")
        raise typer.Exit(FAILED)
    typer.echo("The end    found, followed, carried away, found again. Nobody had to help.")


def _told(steps: list[DemoStep], episodes: list[Episode]) -> list[str]:
    from firstfix.cli.answers import pose_text

    titles = ("Wakes up", "Carried", "Kidnapped")
    opening = (
        "at {pose}, and does not know it",
        "off by somebody; its wheels hang, and are heard to. Set down at {pose}",
        "in an instant, and no wheel or switch tells. Now at {pose}",
    )
    lines = []
    for episode, title, words in zip(episodes, titles, opening, strict=False):
        first = next(step for step in steps if step.stamp >= episode.began_s)
        lines.append(f"\n{title:10s} {words.format(pose=pose_text(first.truth))}")
        lines += [f"           {line}" for line in _episode_lines(episode)]
    cpu = sorted(step.cpu_s for step in steps)
    lines.append(
        f"\nTime       {steps[-1].stamp:.0f} s of it, {len(steps)} scans; the localizer took "
        f"{1e3 * cpu[len(cpu) // 2]:.1f} ms of processor a scan (median), "
        f"{1e3 * cpu[-1]:.0f} ms at most, {sum(cpu) / steps[-1].stamp:.1%} of one core"
    )
    return lines


def _episode_lines(episode: Episode) -> list[str]:
    wrong = [f"{episode.wrong_finds} times found where it was not"] if episode.wrong_finds else []
    if episode.found_s is None:
        return [*wrong, "not found"]
    when = "by the first scan" if episode.found_s < 0.05 else f"after {episode.found_s:.1f} s"
    noticed = f"noticed after {episode.noticed_s:.1f} s, " if episode.noticed_s else ""
    found = (
        f"{noticed}found {when}, {100 * episode.found_error_m:.1f} cm and "
        f"{episode.found_error_deg:.2f}° from the truth"
    )
    if math.isnan(episode.kept):
        return [*wrong, found]
    followed = (
        f"followed: {episode.kept:.1%} of the scans within 0.5 m and 10°, "
        f"error {100 * episode.rmse_m:.1f} cm and {episode.rmse_deg:.2f}° (RMSE)"
    )
    return [*wrong, found, followed]
