"""``firstfix bench``: how good it is, how fast, on which cases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from firstfix.cli.bench_kidnap import PANEL as KIDNAP_PANEL
from firstfix.cli.bench_kidnap import MoreCases, Scenarios, Worlds, bench_kidnap
from firstfix.cli.bench_locate import bench_locate
from firstfix.cli.bench_suite import Runs, Suites, bench_suite
from firstfix.cli.bench_track import PANEL, Params, Seed, bench_track
from firstfix.cli.options import refuse_options
from firstfix.core.errors import InputError
from firstfix.global_localization.config import Method


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
    wrong_map: Annotated[
        bool,
        typer.Option(
            "--wrong-map", "--foreign", help="Also try each case's scans in the next building."
        ),
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
    suite: Suites = None,
    runs: Runs = None,
) -> None:
    """Locate every scan of every case and compare with the truth.

    Times are processor time of one scan, kernels compiled, map prepared; memory is the peak of a
    process that does nothing else. The totals 'total' and 'wrong_map' of the JSON are those of
    the first --method; 'totals' has one for each.
    """
    cases = [*(cases or []), *(more_cases or [])]
    of_locating = {"--method": method, "--wrong-map": wrong_map, "--limit": limit}
    of_kidnapping = {"--kidnap": kidnapped, "--scenarios": scenarios, "--worlds": worlds}
    of_suites = {"--suite": suite, "--runs": runs}
    if suite is not None:
        others: dict[str, object] = {
            "--method": method,
            "--wrong-map": wrong_map,
            "--params": params,
        }
        others |= {"--track": tracked, "--kidnap": kidnapped, "--scenarios": scenarios}
        refuse_options(f"--suite {suite.value}", others)
        bench_suite(
            suite,
            cases,
            worlds=worlds,
            runs=runs,
            seed=seed,
            limit=limit,
            jobs=jobs,
            json_file=json_file,
            report=report,
        )
        return
    if tracked:
        refuse_options("--track", {"--report": report, **of_locating, **of_kidnapping, **of_suites})
        _check_cases(cases)
        bench_track(cases, json_file, jobs, params, seed)
        return
    if kidnapped:
        refuse_options("--kidnap", {"--params": params, **of_locating, **of_suites})
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
            expected="--scenarios with --kidnap, --worlds with it or --suite paper",
            received="one of them without",
            remedy="add --kidnap, or leave them out",
        )
    if params is not None or seed is not None:
        raise InputError(
            expected="--params and --seed with --track, or --seed with --kidnap or --suite",
            received="one of them without",
            remedy="add --track, or leave them out: locating has no chance in it",
        )
    refuse_options("locating", of_suites)
    _check_cases(cases)
    bench_locate(
        cases,
        list(dict.fromkeys(method or [Method.FAST])),
        wrong_map=wrong_map,
        jobs=jobs,
        limit=limit,
        json_file=json_file,
        report=report,
    )


def _check_cases(cases: list[Path]) -> None:
    if not cases:
        raise InputError(
            expected="CASES: at least one folder of a case, or of cases",
            received="none",
            remedy="name one; only --kidnap and --suite paper or scaling can do without",
        )
