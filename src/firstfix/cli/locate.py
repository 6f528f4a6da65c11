"""``firstfix locate``: the pose at which a scan was taken."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.answer import Waited, print_answer
from firstfix.cli.known_changes import KnownChanges, load_changed_map
from firstfix.cli.prior_options import NearPoses, Radius, RegionText, prior_of
from firstfix.cli.progress import progress, working
from firstfix.cli.sensor_options import (
    BaseFrame,
    HeightBand,
    LaserFrame,
    LaserPose,
    Topics,
    read_log,
)
from firstfix.core.errors import InputError, ScanError
from firstfix.global_localization.config import Method

if TYPE_CHECKING:
    from firstfix.core.estimate import LocateResult
    from firstfix.core.recording import Recording
    from firstfix.global_localization.prior import Prior
    from firstfix.global_localization.scan_matcher import ScanMatcher

NO_ANSWER = 1


def locate(
    map_path: Annotated[Path, typer.Argument(metavar="MAP", help="YAML of a map_server map.")],
    scans: Annotated[
        Path, typer.Argument(metavar="SCANS", help=".npz, ROS 1 or ROS 2 bag, or CARMEN log.")
    ],
    index: Annotated[
        int | None, typer.Option("--index", min=0, help="Which scan, from 0.", show_default="0")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Locate every scan.")] = False,
    method: Annotated[Method, typer.Option(help="How the map is searched.")] = Method.FAST,
    as_lines: Annotated[bool, typer.Option("--json", help="Print one JSON line a scan.")] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the answer: .png, .svg or .pdf.")
    ] = None,
    topic: Topics = None,
    laser_pose: LaserPose = None,
    base_frame: BaseFrame = None,
    laser_frame: LaserFrame = None,
    height_band: HeightBand = None,
    near: NearPoses = None,
    radius: Radius = None,
    region: RegionText = None,
    changes: KnownChanges = None,
) -> None:
    """Find the pose at which a scan was taken, anywhere in the map.

    With several --topic, the scans that the sensors took together count together, and --index
    counts the scans of the first topic. One scan (not --all) ends with exit status 0 if its place
    is UNIQUE and 1 if it is not.
    """
    _check_options(index, every, plot)
    prior = prior_of(map_path, near, radius, region)
    from firstfix.core.estimate import Verdict
    from firstfix.lab.experiments.case import truth_at

    grid = load_changed_map(map_path, changes)
    first = index or 0
    # The scan of another sensor that is nearest in time may come later.
    several = topic is not None and len(topic) > 1
    limit = None if every or several else first + 1
    recording = read_log(scans, topic, laser_pose, base_frame, laser_frame, limit, height_band)
    instants = recording.instants()
    chosen = range(len(instants)) if every else _only(len(instants), first)
    for note in recording.notes:
        typer.echo(f"note: {note}", err=True)

    with working("preparing the map"):
        # Imported after the files are read, so that bad input is refused at once.
        from firstfix.fields.cache import cache_folder
        from firstfix.global_localization.precompile import precompile_search
        from firstfix.global_localization.scan_matcher import ScanMatcher

        began = time.perf_counter()
        precompile_search(method)
        loaded = time.perf_counter()
        matcher = ScanMatcher(grid, method=method, cache_dir=cache_folder())
        waited = Waited(loaded - began, time.perf_counter() - loaded)
    # On a terminal the answers themselves show how far it is.
    with progress(0 if sys.stdout.isatty() else len(chosen), "locating") as done:
        for i in chosen:
            truth = truth_at(recording, instants[i][0])
            result = _located(matcher, recording, instants[i], prior)
            if as_lines:
                typer.echo(json.dumps(result.to_dict(i, truth), allow_nan=False))
            else:
                print_answer(result, truth, waited, f"scan {i}: " if every else "")
            done(result.verdict.value)
    if plot is not None:
        from firstfix.plots.result_picture import draw_result

        typer.echo(f"picture: {draw_result(grid, result.scans, result, plot, truth)}", err=True)
    if not every and result.verdict is not Verdict.UNIQUE:
        raise typer.Exit(NO_ANSWER)


def _check_options(index: int | None, every: bool, plot: Path | None) -> None:
    if every and (index is not None or plot is not None):
        raise InputError(
            expected="--all, or else one scan with --index or --plot",
            received=f"--all with {'--index' if index is not None else '--plot'}",
            remedy="leave one of them out",
        )
    if plot is not None:
        from firstfix.lab.reports.output_files import check_picture

        check_picture(plot)


def _located(
    matcher: ScanMatcher, recording: Recording, instant: tuple[int, ...], prior: Prior | None
) -> LocateResult:
    """Locate the scans of one instant together, moved to one time by odometry where it is known."""
    scans, odometry = [recording.scans[i] for i in instant], recording.odometry
    if len(scans) == 1 or odometry is None:
        return matcher.locate(scans, prior=prior)
    poses = [pose for scan in scans if (pose := odometry.at(scan.stamp)) is not None]
    return matcher.locate(scans, poses if len(poses) == len(scans) else None, prior)


def _only(count: int, index: int) -> range:
    if index >= count:
        raise ScanError(
            expected=f"a log with a scan of index {index}",
            received=f"{count} scans, 0 to {count - 1}",
            remedy="choose a smaller --index",
        )
    return range(index, index + 1)
