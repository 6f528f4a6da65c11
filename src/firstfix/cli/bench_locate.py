"""``firstfix bench CASES``: every scan of every case is located and compared with the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from firstfix.cli.progress import progress
from firstfix.cli.targets import check_targets, write_json
from firstfix.global_localization.config import Method

if TYPE_CHECKING:
    from firstfix.lab.experiments.case_runs import CaseRun, WrongMapRun
    from firstfix.lab.experiments.case_tasks import CaseTask, WrongMapTask


def bench_locate(
    cases: list[Path],
    methods: list[Method],
    *,
    wrong_map: bool,
    jobs: int,
    limit: int,
    json_file: Path | None,
    report: Path | None,
) -> None:
    """Locate scans of cases.

    Parameters
    ----------
    cases : list of Path
        Folders of cases, or of folders of cases.
    methods : list of Method
        At least one, each once.
    wrong_map : bool
        Whether scans are also tried on the map of another building.
    jobs : int
        Cases at a time.
    limit : int
        Scans of a case, evenly spaced; 0 tries all.
    json_file : Path or None
        Where all figures go.
    report : Path or None
        Folder of a report.

    Raises
    ------
    InputError
        If a case cannot be used.
    """
    from firstfix.cli.cases import find_cases
    from firstfix.lab.experiments import case_tasks as runner
    from firstfix.lab.experiments.case_runs import CaseRun, WrongMapRun
    from firstfix.lab.reports.document import bench_document
    from firstfix.lab.reports.tables import bench_table, wrong_map_table

    found = find_cases(cases)
    check_targets(json_file, report)
    tasks: list[CaseTask | WrongMapTask] = [*runner.case_tasks(found, methods, limit)]
    if wrong_map:
        tasks += runner.wrong_map_tasks(found, methods, limit)
    with progress(len(tasks), "bench") as done:
        runs = runner.run_tasks(tasks, jobs, lambda run: done(_told(run)))
    own = [run for run in runs if isinstance(run, CaseRun)]
    others = [run for run in runs if isinstance(run, WrongMapRun)]
    document = bench_document(own, others, methods)
    typer.echo(bench_table(document), nl=False)
    if wrong_map:
        typer.echo("\n" + wrong_map_table(document), nl=False)
        if not others:
            typer.echo(
                "note: all cases are of one site: no scan was tried on a wrong map", err=True
            )
    if json_file is not None:
        write_json(document, json_file)
    if report is not None:
        from firstfix.lab.reports.report import write_report

        typer.echo(f"report: {write_report(own, document, report)}", err=True)


def _told(run: CaseRun | WrongMapRun) -> str:
    return f"{run.case}, {run.method.value}"
