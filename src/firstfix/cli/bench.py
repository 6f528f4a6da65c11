"""``firstfix bench``: how good the localization is and what it costs, measured on cases."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from firstfix.cli.progress import progress
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.lab.experiments.bench_method import BenchMethod
    from firstfix.lab.experiments.benchmark import Benchmark
    from firstfix.lab.experiments.case import Case

TRACKING, KIDNAPPING, STARTING, SUITES = "Tracking", "Kidnapping", "Starts", "Suites"

KIDNAP_SCENARIOS, KIDNAP_DRIVES = 20, 3
PAPER_DRIVES = 5
STARTS = 20

# In these rooms no robot can be found, because all places are identical.
_HOPELESS = {"rooms"}


class Suite(Enum):
    """Experiments that are more than a run over cases."""

    PAPER = "paper"
    SCALING = "scaling"
    ABLATION = "ablation"
    CALIBRATION = "calibration"


class Printed(Enum):
    """What is printed."""

    TABLES = "tables"
    JSON = "one JSON object"


# Which options belong to which benchmark. --json and --out belong to all.
_CASES = {"CASES", "--floors", "--sensor"}
_LOCATE = {*_CASES, "--method", "--estimates", "--wrong-map", "--limit", "--jobs", "--report"}
_OPTIONS = {
    "locating": _LOCATE,
    "--track": {*_CASES, "--params", "--seed", "--jobs"},
    "--kidnap": {*_CASES, "--worlds", "--scenarios", "--seed", "--jobs", "--report"},
    "--starts": {*_CASES, "--runs", "--seed", "--jobs", "--report"},
    "--site": {"--floors", "--limit", "--maps", "--jobs"},
    "--rides": {"--seed", "--maps", "--jobs"},
    "--suite paper": {"--worlds", "--runs", "--seed", "--jobs", "--report"},
    "--suite scaling": {"--seed", "--report"},
    "--suite ablation": {*_CASES, "--limit", "--jobs", "--report"},
    "--suite calibration": {*_CASES, "--limit", "--jobs", "--report"},
}
_WITHOUT_CASES = {"--kidnap", "--rides", "--suite paper", "--suite scaling"}


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
        list[str] | None,
        typer.Option(
            metavar="METHOD",
            help="fast, paper or paper-basic; or MODULE:FUNCTION, a function of map and scan that "
            "returns a pose, (pose, confidence) or None. Repeatable.",
            show_default="fast",
        ),
    ] = None,
    estimates: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="CSV",
            help="Judge poses of another program: columns case, scan, x, y, yaw and optionally "
            "confidence. Repeatable.",
            show_default=False,
        ),
    ] = None,
    sensor: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FOV,RANGE",
            help="Cut the scans to a sensor with this field of view (degrees) and range (m), such "
            "as 60,5; `recorded` leaves them as they are. Repeatable.",
            show_default="recorded",
        ),
    ] = None,
    floors: Annotated[
        str | None,
        typer.Option(
            metavar="FIRST-LAST",
            help="Also drives on random floors with these seeds, such as 1000-1023: drawn maps, "
            "and worlds that differ from them.",
            show_default=False,
        ),
    ] = None,
    as_object: Annotated[
        bool, typer.Option("--json", help="Print all figures as one JSON object.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write all figures to a JSON file.")
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
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="Of all randomness.", show_default="random_seed of --params, else 0"
        ),
    ] = None,
    tracked: Annotated[
        bool,
        typer.Option(
            "--track",
            help="Track each case with odometry from its true start instead.",
            rich_help_panel=TRACKING,
        ),
    ] = False,
    params: Annotated[
        Path | None,
        typer.Option(
            metavar="YAML",
            help="Parameters of Nav2's AMCL.",
            show_default="Nav2's own",
            rich_help_panel=TRACKING,
        ),
    ] = None,
    starts: Annotated[
        bool,
        typer.Option(
            "--starts",
            help="Start the localizer at random places of each recorded drive instead.",
            rich_help_panel=STARTING,
        ),
    ] = False,
    site: Annotated[
        bool,
        typer.Option(
            "--site",
            help="Make one site of the maps of --floors and ask in which map, and where, scans of "
            "their true worlds were taken instead.",
            rich_help_panel=STARTING,
        ),
    ] = False,
    rides: Annotated[
        int | None,
        typer.Option(
            "--rides",
            min=1,
            help="Ride the lift of a drawn building of 10 floors so often instead; count poses on "
            "wrong floors, and how soon the right one is found.",
            show_default=False,
            rich_help_panel=STARTING,
        ),
    ] = None,
    maps: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Keep the maps of --site or --rides, and what is prepared of them, in this "
            "folder: another run uses them, and one that was stopped goes on.",
            show_default="a folder that is removed",
            rich_help_panel=STARTING,
        ),
    ] = None,
    kidnapped: Annotated[
        bool,
        typer.Option(
            "--kidnap",
            help="Kidnap simulated robots, and with cases recorded ones, instead.",
            rich_help_panel=KIDNAPPING,
        ),
    ] = False,
    scenarios: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Scenarios in each world, joined drives of each case.",
            show_default=f"{KIDNAP_SCENARIOS}, {KIDNAP_DRIVES}",
            rich_help_panel=KIDNAPPING,
        ),
    ] = None,
    worlds: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME...",
            help="Built-in buildings: office, warehouse, house, corridor, rooms, hotel.",
            show_default="all but rooms, which are identical; none with cases",
            rich_help_panel=KIDNAPPING,
        ),
    ] = None,
    more_cases: Annotated[
        list[Path] | None,
        typer.Option(
            "--cases",
            metavar="DIR",
            help="The same as CASES. Repeatable.",
            rich_help_panel=KIDNAPPING,
        ),
    ] = None,
    suite: Annotated[
        Suite | None,
        typer.Option(
            help="paper: ways of starting in built-in buildings. scaling: time and memory against "
            "area, beams and threads. ablation: CASES with each step of the default method left "
            "out. calibration: the law of one scan, chosen without each building and judged there.",
            show_default=False,
            rich_help_panel=SUITES,
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Drives in each world (--suite paper), starts on each drive (--starts).",
            show_default=f"{PAPER_DRIVES}, {STARTS}",
            rich_help_panel=SUITES,
        ),
    ] = None,
) -> None:
    """Locate every scan of every case and compare with the truth.

    Times are processor time of one scan, with compiled kernels and a prepared map. Memory is the
    peak of a process that does nothing else. The totals 'total' and 'wrong_map' of the JSON are
    those of the first --method and --sensor; 'totals' has one for each.
    """
    folders = [*(cases or []), *(more_cases or [])]
    given: dict[str, Any] = {
        "CASES": folders,
        "--floors": floors,
        "--method": method,
        "--estimates": estimates,
        "--sensor": sensor,
        "--wrong-map": wrong_map,
        "--limit": limit,
        "--jobs": jobs > 1,
        "--report": report,
        "--seed": seed,
        "--params": params,
        "--scenarios": scenarios,
        "--worlds": worlds,
        "--runs": runs,
        "--maps": maps,
    }
    asked = {"--track": tracked, "--starts": starts, "--kidnap": kidnapped, "--site": site}
    asked["--rides"] = rides is not None
    if suite is not None:
        asked[f"--suite {suite.value}"] = True
    measure = _check_options([name for name, is_asked in asked.items() if is_asked], given)

    from firstfix.lab import benchmarks
    from firstfix.lab.experiments.case import find_cases, parse_sensor
    from firstfix.lab.experiments.floor_cases import floor_case, parse_floors
    from firstfix.lab.experiments.paper_bench import PAPER_WORLDS
    from firstfix.lab.experiments.site_bench import QUERIES
    from firstfix.lab.experiments.track_log import load_config
    from firstfix.lab.reports.output_files import check_targets
    from firstfix.lab.worlds.catalog import WORLDS, parse_worlds

    sensors = list(dict.fromkeys(parse_sensor(text) for text in sensor or ["recorded"]))
    if measure in ("--site", "--rides"):
        with _kept_or_temporary(maps) as folder:
            benchmark = (
                benchmarks.rides_benchmark(folder, seed or 0, rides)
                if rides is not None
                else benchmarks.site_benchmark(folder, parse_floors(floors), limit or QUERIES)
            )
            _run(benchmark, jobs, Printed.JSON if as_object else Printed.TABLES, out, report)
        return
    drawn = [floor_case(number) for number in parse_floors(floors)]
    found: list[Case] = benchmarks.cut_to_sensors([*find_cases(folders), *drawn], sensors)
    first_seed = seed or 0
    if measure == "--track":
        benchmark = benchmarks.track_benchmark(found, load_config(params, seed).localizer.amcl)
    elif measure == "--starts":
        benchmark = benchmarks.start_benchmark(found, runs or STARTS, first_seed)
    elif measure == "--kidnap":
        usual = [] if found else [name for name in WORLDS if name not in _HOPELESS]
        benchmark = benchmarks.kidnap_benchmark(
            usual if worlds is None else parse_worlds(worlds, WORLDS),
            scenarios or KIDNAP_SCENARIOS,
            found,
            scenarios or KIDNAP_DRIVES,
            first_seed,
        )
    elif measure == "--suite paper":
        names = list(PAPER_WORLDS) if worlds is None else parse_worlds(worlds, PAPER_WORLDS)
        benchmark = benchmarks.paper_benchmark(names, runs or PAPER_DRIVES, first_seed)
    elif measure == "--suite scaling":
        check_targets(out, report)  # drawing the maps takes a while
        benchmark = benchmarks.scaling_benchmark(first_seed)
    elif measure == "--suite ablation":
        benchmark = benchmarks.ablation_benchmark(found, limit)
    elif measure == "--suite calibration":
        benchmark = benchmarks.calibration_benchmark(found, limit)
    else:
        methods = _methods(method or [], estimates or [], on_wrong_maps=wrong_map)
        benchmark = benchmarks.locate_benchmark(found, methods, limit, with_wrong_maps=wrong_map)
    _run(benchmark, jobs, Printed.JSON if as_object else Printed.TABLES, out, report)


@contextmanager
def _kept_or_temporary(folder: Path | None) -> Iterator[Path]:
    """Give a folder: one that is kept, or a new one that is removed."""
    from firstfix.lab.reports.output_files import make_folder

    if folder is not None:
        make_folder(folder)
        yield folder
        return
    with tempfile.TemporaryDirectory(prefix="firstfix-site-") as temporary:
        yield Path(temporary)


def _methods(names: list[str], estimates: list[Path], *, on_wrong_maps: bool) -> list[BenchMethod]:
    from firstfix.lab.experiments.bench_method import Estimates, parse_method, read_estimates

    if estimates and on_wrong_maps:
        raise InputError("Leave out --wrong-map: --estimates has poses in the right maps only.")
    for path in estimates:
        read_estimates(path)  # faults are found before the work
    if not names and not estimates:
        names = ["fast"]
    return [*map(parse_method, dict.fromkeys(names)), *map(Estimates, dict.fromkeys(estimates))]


def _check_options(asked: list[str], given: dict[str, Any]) -> str:
    """Return the benchmark that was asked for; refuse options that do not belong to it."""
    if len(asked) > 1:
        raise InputError(
            expected="one benchmark",
            received=f"{asked[0]} with {', '.join(asked[1:])}",
            remedy="run them one after the other",
        )
    measure = asked[0] if asked else "locating"
    wrong = [name for name, value in given.items() if value and name not in _OPTIONS[measure]]
    wrong += ["--seed"] if given["--seed"] == 0 and "--seed" not in _OPTIONS[measure] else []
    if wrong:
        fitting = [name for name, options in _OPTIONS.items() if set(wrong) <= options]
        raise InputError(
            expected=f"{measure} with options that belong to it",
            received=f"{measure} with {', '.join(wrong)}",
            remedy=f"leave out {', '.join(wrong)}"
            + (f", or ask for {' or '.join(fitting)}" if fitting else ""),
        )
    if measure not in _WITHOUT_CASES and not given["CASES"] and not given["--floors"]:
        raise InputError(
            expected="CASES: at least one folder of a case, or of cases; or --floors",
            received="none",
            remedy="name one; only --kidnap, --rides and --suite paper or scaling can do without",
        )
    return measure


def _run(
    benchmark: Benchmark, jobs: int, printed: Printed, out: Path | None, report: Path | None
) -> None:
    from firstfix.lab.reports.output_files import check_targets, write_json

    check_targets(out, report)
    with progress(len(benchmark.tasks), "bench") as done:
        summary = benchmark.run(jobs, done)
    for note in summary.notes:
        typer.echo(f"note: {note}", err=True)
    if printed is Printed.JSON:
        typer.echo(json.dumps(summary.document, allow_nan=False))
    else:
        typer.echo("\n".join(summary.tables), nl=False)
    if out is not None:
        write_json(summary.document, out)
    if report is not None and summary.write_report is not None:
        typer.echo(f"report: {summary.write_report(report)}", err=True)
