"""The benchmarks of ``firstfix bench``: which tasks each runs, and how it sums them up."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.lab.experiments.ablation import AblationTask, ablation_document, ablation_table
from firstfix.lab.experiments.bench_method import BenchMethod
from firstfix.lab.experiments.benchmark import Benchmark, Summary
from firstfix.lab.experiments.calibration import (
    FEWEST_BUILDINGS,
    calibration_document,
    calibration_tables,
    calibration_tasks,
)
from firstfix.lab.experiments.case import Case, SensorCut
from firstfix.lab.experiments.kidnap_bench import KidnapCaseTask, KidnapResult, KidnapWorldTask
from firstfix.lab.experiments.locate_bench import (
    CaseRun,
    CaseTask,
    WrongMapRun,
    WrongMapTask,
    wrong_map_tasks,
)
from firstfix.lab.experiments.paper_bench import DRIVE_S, PaperResult, PaperTask
from firstfix.lab.experiments.rides_bench import ride_tasks, rides_document, rides_table
from firstfix.lab.experiments.scaling import (
    cost_table,
    scaling_document,
    scaling_tasks,
    threads_table,
)
from firstfix.lab.experiments.site_bench import site_document, site_table, site_tasks
from firstfix.lab.experiments.start_bench import StartResult, StartTask
from firstfix.lab.experiments.track_bench import TrackRun, TrackTask, track_document, track_table
from firstfix.lab.reports import start_report
from firstfix.lab.reports.kidnap_report import (
    kidnap_document,
    kidnap_table,
    kinds_table,
    write_kidnap_report,
)
from firstfix.lab.reports.locate_document import (
    bench_document,
    bench_table,
    sensors_table,
    wrong_map_table,
)
from firstfix.lab.reports.locate_report import write_report
from firstfix.lab.reports.paper_report import (
    paper_document,
    paper_table,
    worlds_table,
    write_paper_report,
)
from firstfix.lab.reports.suite_reports import (
    write_ablation_report,
    write_calibration_report,
    write_scaling_report,
)

# Scenarios that share a process: few enough to show progress, enough to pay for its start.
_KIDNAPS_A_TASK = 5


def locate_benchmark(
    cases: Sequence[Case], methods: Sequence[BenchMethod], limit: int, *, with_wrong_maps: bool
) -> Benchmark:
    """Locate scans of cases, on request also in the map of the next other building.

    Parameters
    ----------
    cases : sequence of Case
        At least one.
    methods : sequence of BenchMethod
        At least one, each once.
    limit : int
        Scans of a case, evenly spaced; 0 for all.
    with_wrong_maps : bool
        True to try the scans also in wrong maps.
    """
    tasks: list[CaseTask | WrongMapTask] = [
        CaseTask(case, method, limit) for method in methods for case in cases
    ]
    if with_wrong_maps:
        for sensor in dict.fromkeys(case.sensor for case in cases):
            own = [case for case in cases if case.sensor == sensor]
            tasks += wrong_map_tasks(own, methods, limit)
    names = [f"{task.case.name}, {task.case.sensor}, {task.method.name}" for task in tasks]

    def summarize(results: list[CaseRun | WrongMapRun]) -> Summary:
        runs = [run for run in results if isinstance(run, CaseRun)]
        others = [run for run in results if isinstance(run, WrongMapRun)]
        document = bench_document(runs, others)
        tables, notes = [bench_table(document)], []
        if len({case.sensor for case in cases}) > 1 or others:
            tables.append(sensors_table(document))
        if others:
            tables.append(wrong_map_table(document))
        elif with_wrong_maps:
            notes = ["all cases are of one site: no scan was tried on a wrong map"]
        report = partial(write_report, runs, document)
        return Summary(document, tuple(tables), tuple(notes), report)

    return Benchmark(tasks, names, summarize)


def track_benchmark(cases: Sequence[Case], config: AmclConfig) -> Benchmark:
    """Track every case that has odometry from its first true pose."""

    def summarize(runs: list[TrackRun]) -> Summary:
        left_out = [run.case for run in runs if run.figures is None]
        if len(left_out) == len(runs):
            raise InputError(
                expected="cases with odometry",
                received=f"only {', '.join(left_out)} without",
                remedy="add `odom` [n, 3] to their scans.npz",
            )
        notes = [f"left out, because without odometry: {', '.join(left_out)}"] if left_out else []
        notes += [f"{run.case}: {note}" for run in runs if run.figures for note in run.notes]
        document = track_document(runs)
        return Summary(document, (track_table(document),), tuple(notes))

    tasks = [TrackTask(case, config, config.seed) for case in cases]
    return Benchmark(tasks, [case.name for case in cases], summarize)


def start_benchmark(cases: Sequence[Case], starts: int, seed: int) -> Benchmark:
    """Start the localizer at random places of every drive, the same ones for all sensors."""

    def summarize(results: list[StartResult]) -> Summary:
        runs = [run for result in results for run in result.runs]
        left_out = {result.case: result.left_out for result in results if result.left_out}
        if not runs:
            raise InputError(
                expected="cases with odometry and true poses",
                received=f"only {', '.join(f'{name} ({why})' for name, why in left_out.items())}",
                remedy="add `odom` [n, 3] to their scans.npz",
            )
        document = start_report.start_document(runs, seed, list(left_out.items()))
        notes = [f"left out: {name} ({why})" for name, why in left_out.items()]
        tables = (start_report.sensors_table(document), start_report.buildings_table(document))
        report = partial(start_report.write_start_report, runs, document)
        return Summary(document, tables, tuple(notes), report)

    tasks = [StartTask(case, starts, seed) for case in cases]
    return Benchmark(tasks, [f"{case.name}, {case.sensor}" for case in cases], summarize)


def kidnap_benchmark(
    worlds: Sequence[str], scenarios: int, cases: Sequence[Case], drives: int, seed: int
) -> Benchmark:
    """Kidnap simulated robots in drawn worlds, and recorded ones by joining pieces of drives.

    Parameters
    ----------
    worlds : sequence of str
        Names of drawn buildings.
    scenarios, drives : int
        In each world, and of each case.
    cases : sequence of Case
        With drives to join.
    seed : int
        Of the first scenario of each; the next has the next seed.
    """
    seeds = range(seed, seed + scenarios)
    shares = [tuple(seeds[i : i + _KIDNAPS_A_TASK]) for i in range(0, scenarios, _KIDNAPS_A_TASK)]
    tasks: list[KidnapWorldTask | KidnapCaseTask] = [
        KidnapWorldTask(world, share) for world in worlds for share in shares
    ]
    tasks += [KidnapCaseTask(case, tuple(range(seed, seed + drives))) for case in cases]
    names = [task.case.name if isinstance(task, KidnapCaseTask) else task.world for task in tasks]

    def summarize(results: list[KidnapResult]) -> Summary:
        left_out = {result.name: result.left_out for result in results if result.left_out}
        if len(left_out) == len(results):
            raise InputError(
                expected="drives with pieces that can be joined",
                received=f"only {', '.join(f'{name} ({why})' for name, why in left_out.items())}",
                remedy="add `odom` and `stamp` to their scans.npz, or try --worlds",
            )
        runs = [run for result in results for run in result.runs]
        document = kidnap_document(runs, list(left_out.items()))
        notes = [f"left out: {name} ({why})" for name, why in left_out.items()]
        tables = (kidnap_table(document), kinds_table(document))
        report = partial(write_kidnap_report, runs, document)
        return Summary(document, tables, tuple(notes), report)

    return Benchmark(tasks, names, summarize)


def paper_benchmark(worlds: Sequence[str], drives: int, seed: int) -> Benchmark:
    """Begin the same simulated drives in different ways; each drive has the next seed."""

    def summarize(results: list[PaperResult]) -> Summary:
        trials = [trial for result in results for trial in result.trials]
        document = paper_document(trials, seed, DRIVE_S)
        tables = ("right / wrong / open\n" + worlds_table(document), paper_table(document))
        shown = [result.shown for result in results]
        return Summary(document, tables, (), partial(write_paper_report, shown, document))

    tasks = [PaperTask(world, tuple(range(seed, seed + drives))) for world in worlds]
    return Benchmark(tasks, worlds, summarize)


def scaling_benchmark(seed: int) -> Benchmark:
    """Locate simulated scans in ever larger maps, with ever more beams, by one thread and two."""
    parts, tasks = zip(*scaling_tasks(seed), strict=True)

    def summarize(results: list[Any]) -> Summary:
        document = scaling_document(list(zip(parts, results, strict=True)), seed)
        tables = (
            cost_table(document["area"]),
            cost_table(document["beams"]),
            threads_table(document["threads"]),
        )
        return Summary(document, tables, (), partial(write_scaling_report, document))

    names = [
        f"{part}, {task.grid.free_area:.0f} m²" for part, task in zip(parts, tasks, strict=True)
    ]
    return Benchmark(tasks, names, summarize)


def site_benchmark(folder: Path, seeds: Sequence[int], queries: int) -> Benchmark:
    """Ask a site of random floors in which map, and where in it, scans were taken.

    Parameters
    ----------
    folder : Path
        For the maps; what is there already is used.
    seeds : sequence of int
        Of the floors.
    queries : int
        Number of scans.
    """
    prepare, ask = site_tasks(folder, seeds, queries)

    def summarize(results: list[Any]) -> Summary:
        document = site_document(results[: len(prepare)], results[len(prepare) :])
        far = document["extrapolated"]
        note = (
            f"extrapolated, not measured: {far['area_m2']:,.0f} m² take {far['cpu_s']:.1f} s of "
            f"processor time, {far['wall_s_16_cores']:.2f} s on 16 cores"
        )
        return Summary(document, (site_table(document),), (note,))

    names = [f"floors up to {task.seeds[-1]}" for task in prepare]
    names += [f"scans up to {task.scans[-1] + 1}" for task in ask]
    return Benchmark([*prepare, *ask], names, summarize, first=len(prepare))


def rides_benchmark(folder: Path, seed: int, rides: int) -> Benchmark:
    """Ride the lift of a drawn building, and count poses on wrong floors.

    Parameters
    ----------
    folder : Path
        For the maps; what is there already is used.
    seed : int
        Of the building and the robots.
    rides : int
        Number of rides.
    """
    build, ride = ride_tasks(folder, seed, rides)

    def summarize(results: list[Any]) -> Summary:
        document = rides_document(seed, [one for of_robot in results[1:] for one in of_robot])
        return Summary(document, (rides_table(document),))

    names = ["the building", *(f"robot {task.robot + 1}" for task in ride)]
    return Benchmark([*build, *ride], names, summarize, first=len(build))


def ablation_benchmark(cases: Sequence[Case], limit: int) -> Benchmark:
    """Locate scans of cases with each step of the default method left out in turn."""

    def summarize(results: list[Any]) -> Summary:
        document = ablation_document([run for of_case in results for run in of_case])
        report = partial(write_ablation_report, document)
        return Summary(document, (ablation_table(document),), (), report)

    tasks = [AblationTask(case, limit) for case in cases]
    return Benchmark(tasks, [case.name for case in cases], summarize)


def calibration_benchmark(cases: Sequence[Case], limit: int) -> Benchmark:
    """Choose the law of one scan without each building, and judge it there."""
    tasks = calibration_tasks(cases, limit)
    if len({task.case.site for task in tasks}) < FEWEST_BUILDINGS:
        raise InputError(
            expected=f"cases of {FEWEST_BUILDINGS} buildings: one is left out, the others choose",
            received=f"{len({case.site for case in cases})}",
            remedy="name more cases, or random floors with --floors",
        )

    def summarize(results: list[Any]) -> Summary:
        document = calibration_document(results)
        report = partial(write_calibration_report, document)
        return Summary(document, calibration_tables(document)[:1], (), report)

    return Benchmark(tasks, [task.case.name for task in tasks], summarize)


def cut_to_sensors(cases: Sequence[Case], sensors: Sequence[SensorCut | None]) -> list[Case]:
    """Return every case with its scans cut to every sensor."""
    return [case.seen_by(sensor) for sensor in sensors for case in cases]
