"""``firstfix bench``: how good it is, how fast, on which cases."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.bench_kidnap import PANEL as KIDNAP_PANEL
from firstfix.cli.bench_kidnap import MoreCases, Scenarios, Worlds, bench_kidnap
from firstfix.cli.bench_track import PANEL, Params, Seed, bench_track
from firstfix.cli.progress import progress
from firstfix.cli.targets import check_file, check_folder, check_plots, write_json
from firstfix.core.errors import InputError
from firstfix.global_localization.config import Method

if TYPE_CHECKING:
    from firstfix.evaluation.bench import CaseTask, ForeignTask
    from firstfix.evaluation.runs import CaseRun, ForeignRun


def bench(
    cases: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="CASES...",
            help="Folders with map.yaml, scans.npz and meta.json, or folders of such folders.",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        list[Method] | None,
        typer.Option(help="Which method; may be given several times.", show_default="fast"),
    ] = None,
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write all figures to a file."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write a report with plots to a folder.")
    ] = None,
    foreign: Annotated[
        bool, typer.Option("--foreign", help="Also try each case's scans in the next building.")
    ] = False,
    jobs: Annotated[int, typer.Option(min=1, help="Cases that run at a time.")] = 1,
    limit: Annotated[
        int, typer.Option(min=0, help="Scans of a case, evenly spaced; 0 tries all.")
    ] = 0,
    tracked: Annotated[
        bool,
        typer.Option(
            "--track",
            help="Follow each case with odometry from its true start instead.",
            rich_help_panel=PANEL,
        ),
    ] = False,
    params: Params = None,
    seed: Seed = None,
    kidnapped: Annotated[
        bool,
        typer.Option(
            "--kidnap",
            help="Kidnap simulated robots, and with cases recorded ones, instead.",
            rich_help_panel=KIDNAP_PANEL,
        ),
    ] = False,
    scenarios: Scenarios = None,
    worlds: Worlds = None,
    more_cases: MoreCases = None,
) -> None:
    """Locate every scan of every case and compare with the truth.

    Times are processor time of one scan, kernels compiled, map prepared; memory is the peak of a
    process that does nothing else. The totals 'total' and 'foreign' of the JSON are those of
    the first --method; 'totals' has one for each.
    """
    cases = [*(cases or []), *(more_cases or [])]
    of_locating = {"--method": method, "--foreign": foreign, "--limit": limit}
    of_kidnapping = {"--kidnap": kidnapped, "--scenarios": scenarios, "--worlds": worlds}
    if tracked:
        _refuse("--track", {"--report": report, **of_locating, **of_kidnapping})
        _check_cases(cases)
        bench_track(cases, json_file, jobs, params, seed)
        return
    if kidnapped:
        _refuse("--kidnap", {"--params": params, **of_locating})
        bench_kidnap(
            cases,
            worlds,
            scenarios=scenarios,
            seed=seed or 0,
            jobs=jobs,
            json_file=json_file,
            report=report,
        )
        return
    if scenarios is not None or worlds is not None:
        raise InputError(
            expected="--scenarios and --worlds with --kidnap",
            received="one of them without it",
            remedy="add --kidnap, or leave them out",
        )
    if params is not None or seed is not None:
        raise InputError(
            expected="--params and --seed with --track, or --seed with --kidnap",
            received="one of them without",
            remedy="add --track, or leave them out: locating has no chance in it",
        )
    _check_cases(cases)
    from firstfix.cli.cases import find_cases
    from firstfix.evaluation import bench as runner
    from firstfix.evaluation.document import bench_document
    from firstfix.evaluation.runs import CaseRun, ForeignRun
    from firstfix.evaluation.tables import bench_table, foreign_table

    methods = list(dict.fromkeys(method or [Method.FAST]))
    found = find_cases(cases)
    _check_targets(json_file, report)
    tasks: list[CaseTask | ForeignTask] = [*runner.case_tasks(found, methods, limit)]
    if foreign:
        tasks += runner.foreign_tasks(found, methods, limit)
    with progress(len(tasks), "bench") as done:
        runs = runner.run_tasks(tasks, jobs, lambda run: done(_told(run)))
    own = [run for run in runs if isinstance(run, CaseRun)]
    others = [run for run in runs if isinstance(run, ForeignRun)]
    document = bench_document(own, others, methods)
    typer.echo(bench_table(document), nl=False)
    if foreign:
        typer.echo("\n" + foreign_table(document), nl=False)
        if not others:
            typer.echo("note: no two cases have different sites; nothing foreign tried", err=True)
    if json_file is not None:
        write_json(document, json_file)
    if report is not None:
        from firstfix.evaluation.report import write_report

        typer.echo(f"report: {write_report(own, document, report)}", err=True)


def _told(run: CaseRun | ForeignRun) -> str:
    return f"{run.case}, {run.method.value}"


def _check_targets(json_file: Path | None, report: Path | None) -> None:
    """Refuse before hours of work what could not be written after them."""
    if json_file is not None:
        check_file(json_file)
    if report is not None:
        check_plots()
        check_folder(report)


def _check_cases(cases: list[Path]) -> None:
    if not cases:
        raise InputError(
            expected="CASES: at least one folder of a case, or of cases",
            received="none",
            remedy="name one; only --kidnap can do without",
        )


def _refuse(measure: str, options: dict[str, object]) -> None:
    """Refuse options that were given although they are not about what is measured."""
    wrong = [name for name, value in options.items() if value]
    if wrong:
        raise InputError(
            expected=f"{measure} without options of other benchmarks",
            received=f"{measure} with {', '.join(wrong)}",
            remedy="leave it out: it is not about this",
        )
