"""``firstfix bench --suite``: experiments that are more than a run over cases."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from firstfix.cli.options import refuse_options

PANEL = "Suites"


class Suite(Enum):
    """Which experiments."""

    PAPER = "paper"
    SCALING = "scaling"
    ABLATION = "ablation"


Suites = Annotated[
    Suite | None,
    typer.Option(
        "--suite",
        help="paper: ways of starting in drawn buildings. scaling: time and memory against area, "
        "beams and threads. ablation: CASES with each step of the default method left out.",
        show_default=False,
        rich_help_panel=PANEL,
    ),
]
Runs = Annotated[
    int | None,
    typer.Option(
        "--runs",
        min=1,
        help="Drives in each world (--suite paper).",
        show_default="5",
        rich_help_panel=PANEL,
    ),
]


def bench_suite(
    suite: Suite,
    cases: list[Path],
    *,
    worlds: str | None,
    runs: int | None,
    seed: int | None,
    limit: int,
    jobs: int,
    json_file: Path | None,
    report: Path | None,
) -> None:
    """Run a suite of experiments.

    Parameters
    ----------
    suite : Suite
        Which one.
    cases : list of Path
        Folders of cases, or of folders of cases: for the ablation alone.
    worlds : str or None
        Names of drawn buildings, with commas between; for the paper alone.
    runs : int or None
        Drives in each of them.
    seed : int or None
        Where chance begins.
    limit : int
        Scans of a case, evenly spaced; 0 tries all. For the ablation alone.
    jobs : int
        Processes at a time.
    json_file : Path or None
        Where all figures go.
    report : Path or None
        Folder of a report.

    Raises
    ------
    InputError
        If an option is not about this suite.
    """
    of_paper = {"--worlds": worlds, "--runs": runs}
    of_ablation = {"CASES": cases, "--limit": limit}
    if suite is Suite.PAPER:
        from firstfix.cli.bench_paper import DRIVES, bench_paper

        refuse_options(f"--suite {suite.value}", of_ablation)
        bench_paper(
            worlds,
            runs=DRIVES if runs is None else runs,
            seed=seed or 0,
            jobs=jobs,
            json_file=json_file,
            report=report,
        )
        return
    refuse_options(f"--suite {suite.value}", of_paper)
    if suite is Suite.SCALING:
        from firstfix.cli.bench_scaling import bench_scaling

        refuse_options(f"--suite {suite.value}", of_ablation | {"--jobs": jobs > 1})
        bench_scaling(seed=seed or 0, json_file=json_file, report=report)
        return
    from firstfix.cli.bench_ablation import bench_ablation

    refuse_options(f"--suite {suite.value}", {"--seed": seed})
    bench_ablation(cases, limit=limit, jobs=jobs, json_file=json_file, report=report)
