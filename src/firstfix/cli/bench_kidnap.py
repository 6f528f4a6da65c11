"""``firstfix bench --kidnap``: how soon a kidnapped robot is missed, and found again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress
from firstfix.cli.targets import check_targets, write_json
from firstfix.cli.worlds import worlds_of
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.lab.experiments.kidnap_runner import CaseTask, Played, WorldTask

PANEL = "Kidnapping"
SCENARIOS = 20
DRIVES = 3

# Where no place is like no other, nobody can be found: only of use to see that nobody claims to.
_HOPELESS = {"rooms"}

# Scenarios that share a process: few enough that progress shows, enough to pay for its start.
_A_TASK = 5

Scenarios = Annotated[
    int | None,
    typer.Option(
        "--scenarios",
        min=1,
        help="Scenarios in each world, spliced drives of each case.",
        show_default=f"{SCENARIOS}, {DRIVES}",
        rich_help_panel=PANEL,
    ),
]
Worlds = Annotated[
    str | None,
    typer.Option(
        "--worlds",
        metavar="NAME,NAME...",
        help="Drawn buildings: office, warehouse, house, corridor, rooms.",
        show_default="all but rooms, whose places are all alike; none with cases",
        rich_help_panel=PANEL,
    ),
]
MoreCases = Annotated[
    list[Path] | None,
    typer.Option(
        "--cases",
        metavar="DIR",
        help="The same as CASES: drives whose pieces are joined. May be given several times.",
        rich_help_panel=PANEL,
    ),
]


def bench_kidnap(
    cases: list[Path],
    worlds: str | None,
    *,
    scenarios: int | None,
    seed: int,
    jobs: int,
    json_file: Path | None,
    report: Path | None,
) -> None:
    """Let simulated and recorded robots be kidnapped, and judge what a localizer makes of it.

    Parameters
    ----------
    cases : list of Path
        Folders of cases, or of folders of cases; pieces of their drives are joined.
    worlds : str or None
        Names of drawn buildings, with commas between; None for all where there are no cases.
    scenarios : int or None
        How many in each of them.
    seed : int
        Of the first scenario of each; the next has the next seed.
    jobs : int
        Processes at a time.
    json_file : Path or None
        Where all figures go.
    report : Path or None
        Folder of a report.

    Raises
    ------
    InputError
        If a world is not known, a case cannot be used, or nothing can be played.
    """
    names = _worlds(worlds) if worlds is not None or not cases else []
    tasks = _tasks(names, cases, scenarios, seed)
    check_targets(json_file, report)
    from firstfix.lab.experiments.kidnap_bench import kidnap_document, kidnap_table, kinds_table
    from firstfix.lab.experiments.process_pool import run_in_processes

    with progress(len(tasks), "bench") as done:
        played = run_in_processes(tasks, jobs, lambda _, ended: done(ended.name))
    _tell(played)
    runs = [run for ended in played for run in ended.runs]
    left_out = {ended.name: ended.left_out for ended in played if ended.left_out is not None}
    document = kidnap_document(runs, list(left_out.items()))
    typer.echo(kidnap_table(document))
    typer.echo(kinds_table(document), nl=False)
    incidents = len(document["incidents"])
    if incidents and json_file is None and report is None:
        typer.echo(f"note: {incidents} to look at; --json or --report tells them", err=True)
    if json_file is not None:
        write_json(document, json_file)
    if report is not None:
        from firstfix.lab.reports.kidnap_report import write_kidnap_report

        typer.echo(f"report: {write_kidnap_report(runs, document, report)}", err=True)


def _worlds(text: str | None) -> list[str]:
    from firstfix.lab.worlds.catalog import WORLDS

    if text is None:
        return [name for name in WORLDS if name not in _HOPELESS]
    return worlds_of(text, WORLDS)


def _tasks(
    worlds: list[str], cases: list[Path], scenarios: int | None, seed: int
) -> list[WorldTask | CaseTask]:
    from firstfix.cli.cases import find_cases
    from firstfix.lab.experiments.kidnap_runner import CaseTask, WorldTask

    tasks: list[WorldTask | CaseTask] = [
        WorldTask(world, seeds)
        for world in worlds
        for seeds in _shares(seed, SCENARIOS if scenarios is None else scenarios)
    ]
    drives = tuple(range(seed, seed + (DRIVES if scenarios is None else scenarios)))
    return tasks + [CaseTask(case, drives) for case in find_cases(cases)]


def _shares(seed: int, count: int) -> list[tuple[int, ...]]:
    seeds = range(seed, seed + count)
    return [tuple(seeds[i : i + _A_TASK]) for i in range(0, count, _A_TASK)]


def _tell(played: list[Played]) -> None:
    """Say what was left out; refuse if that is all."""
    left_out = [f"{ended.name} ({ended.left_out})" for ended in played if ended.left_out]
    if len(left_out) == len(played):
        raise InputError(
            expected="drives of which pieces can be joined",
            received=f"only {', '.join(left_out)}",
            remedy="add `odom` and `stamp` to their scans.npz, or try --worlds",
        )
    for name in left_out:
        typer.echo(f"note: left out: {name}", err=True)
