"""``firstfix track``: the pose at every scan of a drive."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.known_changes import KnownChanges, load_changed_map
from firstfix.cli.prior_options import NearPoses, Radius, RegionText, prior_of
from firstfix.cli.progress import progress
from firstfix.cli.sensor_options import (
    BaseFrame,
    HeightBand,
    LaserFrame,
    LaserPose,
    Topics,
    read_log,
)
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.core.se2 import SE2

SEARCH, TRUTH = "search", "truth"
STARTS = f"X,Y,YAW (m, m, rad), {SEARCH}, {TRUTH}, or the file of a saved pose"
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
            help=f"Pose of the base in the map at the first scan that has odometry: {STARTS}.",
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
    topic: Topics = None,
    laser_pose: LaserPose = None,
    base_frame: BaseFrame = None,
    laser_frame: LaserFrame = None,
    height_band: HeightBand = None,
    near: NearPoses = None,
    radius: Radius = None,
    region: RegionText = None,
    changes: KnownChanges = None,
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
    """Track the robot through a log, from a known start or, with --start search, from anywhere.

    A search also checks every pose, and finds the robot again after it was carried away; exit
    status 1 if it is never found. If the log has true poses, the track is compared with them. All
    poses are those of the base in the map.
    """
    requested = _parse_start(start)
    _check_targets(out, plot, keep_pose)
    prior = prior_of(map_path, near, radius, region)
    if prior is not None and requested != SEARCH:
        raise InputError(
            "--near and --region say where a search begins. Add --start search, or leave them out."
        )
    if changes is not None and requested != SEARCH:
        raise InputError(
            "--changes is used by the search, not by a track from a known start. Add --start "
            "search, or leave it out."
        )
    grid = load_changed_map(map_path, changes)
    if prior is not None:
        prior.check(grid)
    recording = read_log(log, topic, laser_pose, base_frame, laser_frame, None, height_band)

    # Imported after the files are read, so that bad input is refused at once.
    from firstfix.lab.experiments.track_log import (
        NeverFoundError,
        choose_start,
        load_config,
        track_log,
    )
    from firstfix.lab.metrics.track_metrics import summarize_track
    from firstfix.lab.reports import track_report
    from firstfix.ros.pose_memory import PoseKeeper

    config = load_config(params, seed)
    begin = choose_start(requested, grid, recording, config)
    for note in (*recording.notes, begin.note):
        typer.echo(f"note: {note}", err=True)
    keeper = PoseKeeper(keep_pose, config.save_pose_rate) if keep_pose is not None else None
    try:
        with progress(len(recording), "tracking") as done:
            amcl = config.localizer.amcl
            tracked_log = track_log(recording, grid, begin, amcl, done, keeper, prior)
    except NeverFoundError as error:
        typer.echo(f"{error}")
        raise typer.Exit(NO_ANSWER) from None
    for note in tracked_log.drive.notes:
        typer.echo(f"note: {note}", err=True)
    tracked = tracked_log.tracked
    figures = summarize_track(tracked)
    if out is not None:
        from firstfix.io.logs.tum import save_trajectory

        save_trajectory(track_report.trajectory_of(tracked), out)
    if plot is not None:
        title = track_report.track_title(figures)
        typer.echo(f"picture: {track_report.draw_track(grid, tracked, plot, title)}", err=True)
    if as_object:
        document = track_report.track_document(tracked_log, figures)
        typer.echo(json.dumps(document, allow_nan=False))
    else:
        typer.echo(track_report.track_text(tracked, figures))


def _parse_start(text: str | None) -> SE2 | Path | str | None:
    """Read ``--start`` before any file is opened: a pose, a file, ``search``, ``truth`` or None."""
    from firstfix.core.se2 import SE2

    if text is None or text in (TRUTH, SEARCH):
        return text
    if Path(text).is_file():
        return Path(text)
    try:
        x, y, yaw = (float(number) for number in text.split(","))
        return SE2(x, y, yaw)
    except (ValueError, InputError):
        raise InputError(
            expected=f"a start as {STARTS}",
            received=f"{text!r}, which is neither three numbers nor a file",
            remedy="write it like --start 1.5,-2,0.7",
        ) from None


def _check_targets(out: Path | None, plot: Path | None, keep_pose: Path | None) -> None:
    from firstfix.lab.reports.output_files import check_file, check_picture

    if plot is not None:
        check_picture(plot)
    for path in (plot, out, keep_pose):
        if path is not None:
            check_file(path)
