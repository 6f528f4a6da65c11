"""``firstfix bench --track``: how well drives are followed from their true start."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress
from firstfix.cli.targets import check_file, write_json
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.lab.experiments.track_bench import TrackRun

PANEL = "Tracking"
Params = Annotated[
    Path | None,
    typer.Option(
        "--params",
        metavar="YAML",
        help="Parameters of Nav2's AMCL.",
        show_default="Nav2's own",
        rich_help_panel=PANEL,
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(
        "--seed",
        min=0,
        help="Of all randomness.",
        show_default="random_seed of --params, else 0",
        rich_help_panel=PANEL,
    ),
]


def bench_track(
    cases: list[Path], json_file: Path | None, jobs: int, params: Path | None, seed: int | None
) -> None:
    """Follow every case that has odometry, and compare with the truth.

    Parameters
    ----------
    cases : list of Path
        Folders of cases, or of folders of cases.
    json_file : Path or None
        Where all figures go.
    jobs : int
        Cases that run at a time.
    params : Path or None
        Parameters of AMCL.
    seed : int or None
        Of all randomness; None for that of the parameters.

    Raises
    ------
    InputError
        If a case cannot be used, or none has odometry.
    """
    from firstfix.cli.cases import find_cases
    from firstfix.cli.settings import load_config
    from firstfix.lab.experiments.track_bench import (
        TrackTask,
        run_track_tasks,
        track_document,
        track_table,
    )

    found = find_cases(cases)
    config = load_config(params, seed).localizer.amcl
    if json_file is not None:
        check_file(json_file)
    tasks = [TrackTask(case, config, config.seed) for case in found]
    with progress(len(tasks), "bench") as done:
        runs = run_track_tasks(tasks, jobs, lambda run: done(run.case))
    _tell(runs)
    document = track_document(runs)
    typer.echo(track_table(document), nl=False)
    if json_file is not None:
        write_json(document, json_file)


def _tell(runs: list[TrackRun]) -> None:
    """Say what was left out; refuse if that is all."""
    left_out = [run.case for run in runs if run.figures is None]
    if len(left_out) == len(runs):
        raise InputError(
            expected="cases with odometry",
            received=f"only {', '.join(left_out)} without",
            remedy="add `odom` [n, 3] to their scans.npz",
        )
    if left_out:
        typer.echo(f"note: left out, because without odometry: {', '.join(left_out)}", err=True)
    for run in runs:
        if run.figures is not None:
            for note in run.notes:
                typer.echo(f"note: {run.case}: {note}", err=True)
