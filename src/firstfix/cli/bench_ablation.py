"""``firstfix bench --suite ablation``: what each step of the default method is worth."""

from __future__ import annotations

from pathlib import Path

import typer

from firstfix.cli.progress import progress
from firstfix.cli.targets import check_targets, write_json
from firstfix.core.errors import InputError


def bench_ablation(
    cases: list[Path], *, limit: int, jobs: int, json_file: Path | None, report: Path | None
) -> None:
    """Locate scans of cases with each step of the default method left out in turn.

    Parameters
    ----------
    cases : list of Path
        Folders of cases, or of folders of cases.
    limit : int
        Scans of a case, evenly spaced; 0 tries all.
    jobs : int
        Cases at a time.
    json_file : Path or None
        Where all figures go.
    report : Path or None
        Folder of a report.

    Raises
    ------
    InputError
        If there is no case, or one cannot be used.
    """
    from firstfix.cli.cases import find_cases

    if not cases:
        raise InputError(
            expected="--suite ablation with CASES",
            received="no case",
            remedy="name folders with map.yaml and scans.npz",
        )
    found = find_cases(cases)
    check_targets(json_file, report)
    from firstfix.lab.experiments.ablation import AblationTask, ablation_document, ablation_table
    from firstfix.lab.experiments.machine import this_machine
    from firstfix.lab.experiments.process_pool import run_in_processes

    tasks = [AblationTask(case, limit) for case in found]
    with progress(len(tasks), "bench") as done:
        ended = run_in_processes(tasks, jobs, lambda i, _: done(found[i].name))
    runs = [run for of_case in ended for run in of_case]
    document = ablation_document(runs) | {"machine": this_machine()}
    typer.echo(ablation_table(document), nl=False)
    if json_file is not None:
        write_json(document, json_file)
    if report is not None:
        from firstfix.lab.reports.suite_reports import write_ablation_report

        typer.echo(f"report: {write_ablation_report(document, report)}", err=True)
