"""``firstfix bench --suite paper``: the paper's experiments, run again."""

from __future__ import annotations

from pathlib import Path

import typer

from firstfix.cli.progress import progress
from firstfix.cli.targets import check_targets, write_json
from firstfix.cli.worlds import worlds_of

DRIVES = 5


def bench_paper(
    worlds: str | None,
    *,
    runs: int,
    seed: int,
    jobs: int,
    json_file: Path | None,
    report: Path | None,
) -> None:
    """Begin the same simulated drives in different ways, and see where they end.

    Parameters
    ----------
    worlds : str or None
        Names of drawn buildings, with commas between; None for all.
    runs : int
        Drives in each of them.
    seed : int
        Of the first drive; the next has the next seed.
    jobs : int
        Worlds at a time.
    json_file : Path or None
        Where all figures go.
    report : Path or None
        Folder of a report.

    Raises
    ------
    InputError
        If a world is not known.
    """
    from firstfix.lab.experiments.paper_runner import DRIVE_S, PAPER_WORLDS, PaperTask

    names = list(PAPER_WORLDS) if worlds is None else worlds_of(worlds, PAPER_WORLDS)
    check_targets(json_file, report)
    from firstfix.lab.experiments.machine import this_machine
    from firstfix.lab.experiments.paper_suite import paper_document, paper_table, worlds_table
    from firstfix.lab.experiments.process_pool import run_in_processes

    tasks = [PaperTask(name, tuple(range(seed, seed + runs))) for name in names]
    with progress(len(tasks), "bench") as done:
        played = run_in_processes(tasks, jobs, lambda _, ended: done(ended.world))
    trials = [trial for ended in played for trial in ended.trials]
    document = paper_document(trials, seed, DRIVE_S) | {"machine": this_machine()}
    typer.echo("right / wrong / open")
    typer.echo(worlds_table(document))
    typer.echo(paper_table(document), nl=False)
    if json_file is not None:
        write_json(document, json_file)
    if report is not None:
        from firstfix.lab.reports.paper_report import write_paper_report

        page = write_paper_report([ended.shown for ended in played], document, report)
        typer.echo(f"report: {page}", err=True)
