"""``firstfix track``: where the robot was at every scan of a drive."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress, working
from firstfix.cli.settings import load_config
from firstfix.cli.start import WAYS, Origin, choose_start, read_start
from firstfix.cli.targets import check_file, check_picture

if TYPE_CHECKING:
    from firstfix.amcl.config import AmclConfig
    from firstfix.core.grid import OccupancyGrid
    from firstfix.core.recording import Recording
    from firstfix.io.saved_pose import SavedPose
    from firstfix.lab.experiments.drive import Drive
    from firstfix.lab.experiments.drive_tracking import TrackedScan

NO_ANSWER = 1


def track(
    map_path: Annotated[Path, typer.Argument(metavar="MAP", help="YAML of a map_server map.")],
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG", help=".npz, ROS 1 or ROS 2 bag, or CARMEN log, with odometry."
        ),
    ],
    start: Annotated[
        str | None,
        typer.Option(
            metavar="START",
            help=f"Pose of the base in the map at the first scan that has odometry: {WAYS}.",
            show_default="initial_pose of --params where it asks for that, else the truth "
            "where the log has it",
        ),
    ] = None,
    params: Annotated[
        Path | None,
        typer.Option(metavar="YAML", help="Parameters of Nav2's AMCL.", show_default="Nav2's own"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the pose at every scan, in the TUM format."),
    ] = None,
    as_object: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw track and scans on the map: .png, .svg or .pdf."),
    ] = None,
    topic: Annotated[
        str | None, typer.Option(help="Scan topic of a bag, where it has several.")
    ] = None,
    keep_pose: Annotated[
        Path | None,
        typer.Option(
            "--save-pose",
            metavar="FILE",
            help="Keep the last pose in a file, at save_pose_rate of the log's time (not where it "
            "is searched) and at the end, for --start.",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="Of all randomness.", show_default="random_seed of --params, else 0"
        ),
    ] = None,
) -> None:
    """Follow the robot through a log, from a known start or, with --start search, from anywhere.

    Searching also checks every pose, and finds the robot again where it was carried away; exit
    status 1 if it is never found.

    Where the log knows the truth, the track is compared with it. Poses are those of the base in the
    map.
    """
    said = read_start(start)
    _check_targets(out, plot, keep_pose)
    from firstfix.io.logs.load import load_recording
    from firstfix.io.maps.map_server import load_map

    parameters = load_config(params, seed)
    config = parameters.localizer.amcl
    grid = load_map(map_path)
    recording = load_recording(log, topic=topic)

    # After the reading: input that cannot be used is told before the kernels are loaded.
    import numpy as np

    from firstfix.cli.track_answers import track_json, track_text, track_title, trajectory_of
    from firstfix.fields.map_fields import MapFields
    from firstfix.lab.experiments.drive import known_odometry, plan_drive
    from firstfix.lab.experiments.drive_tracking import check_start, follow_drive, make_tracker
    from firstfix.lab.metrics.track_metrics import summarize_track

    known_odometry(recording)  # without it, no start would help
    begin = choose_start(said, grid, recording, parameters)
    for note in (*recording.notes, begin.note):
        typer.echo(f"note: {note}", err=True)
    keeper, key = None, ""
    if keep_pose is not None:
        from firstfix.io.saved_pose import map_key
        from firstfix.ros.pose_memory import PoseKeeper

        keeper, key = PoseKeeper(keep_pose, parameters.save_pose_rate), map_key(grid)
    if begin.origin is Origin.SEARCH:
        drive, tracked = _searched(recording, grid, config)
    else:
        drive = plan_drive(recording, begin.T_map_base)
        check_start(grid, drive.begin_at)
        with working("preparing the map"):
            tracker, fields = make_tracker(grid, config), MapFields(grid)
        rng = np.random.default_rng(config.seed)
        tracked = []
        with progress(len(drive.sights), "tracking") as done:
            for scan in follow_drive(drive, tracker, config, begin.covariance, rng, fields):
                tracked.append(scan)
                if keeper is not None:
                    keeper.offer(_saved(scan, key))
                done(f"{scan.particles} particles")
    for note in drive.notes:
        typer.echo(f"note: {note}", err=True)
    figures = summarize_track(tracked)
    if keeper is not None:
        keeper.save(_saved(tracked[-1], key))
    if out is not None:
        from firstfix.io.logs.tum import save_trajectory

        save_trajectory(trajectory_of(tracked), out)
    if plot is not None:
        from firstfix.lab.reports.track_picture import draw_track

        typer.echo(f"picture: {draw_track(grid, tracked, plot, track_title(figures))}", err=True)
    if as_object:
        document = track_json(begin, drive, tracked, figures)
        typer.echo(json.dumps(document, allow_nan=False))
    else:
        typer.echo(track_text(tracked, figures))


def _searched(
    recording: Recording, grid: OccupancyGrid, config: AmclConfig
) -> tuple[Drive, list[TrackedScan]]:
    from firstfix.lab.experiments.searched_start import NeverFoundError, search_and_follow

    try:
        with progress(len(recording), "tracking") as done:
            return search_and_follow(recording, grid, config, done)
    except NeverFoundError as error:
        typer.echo(f"{error}")
        raise typer.Exit(NO_ANSWER) from None


def _saved(tracked: TrackedScan, map_key: str) -> SavedPose:
    from firstfix.io.saved_pose import SavedPose

    return SavedPose(
        T_map_base=tracked.T_map_base,
        covariance=tracked.covariance,
        stamp=tracked.sight.scan.stamp,
        T_odom_base=tracked.sight.T_odom_base,
        map_key=map_key,
    )


def _check_targets(out: Path | None, plot: Path | None, keep_pose: Path | None) -> None:
    if plot is not None:
        check_picture(plot)
        check_file(plot)
    for path in (out, keep_pose):
        if path is not None:
            check_file(path)
