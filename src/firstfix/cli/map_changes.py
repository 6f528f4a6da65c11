"""``firstfix map changes``: what drives contradict in a map."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress
from firstfix.cli.sensor_options import BaseFrame, LaserFrame, LaserPose, Topics, read_log
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firstfix.core.grid import OccupancyGrid
    from firstfix.core.recording import Recording
    from firstfix.core.trajectory import Trajectory
    from firstfix.lab.experiments.drive_changes import Sighting


def changes(
    map_path: Annotated[Path, typer.Argument(metavar="MAP", help="YAML of a map_server map.")],
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help=".npz, ROS 1 or ROS 2 bag, or CARMEN log."),
    ],
    poses: Annotated[
        Path | None,
        typer.Option(
            metavar="TUM",
            help="Poses of the base in the map over time.",
            show_default="firstfix localizes the robot",
        ),
    ] = None,
    truth: Annotated[bool, typer.Option("--truth", help="Use the true poses in the log.")] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Draw the changes: .png, .svg or .pdf.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Write changes.yaml (a map_server layer of the changes alone), map.yaml (the map "
            "with the changes), changes.json, changes.png, and the counts of each day.",
        ),
    ] = None,
    earlier: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", help="Add the days of an earlier --out; repeatable."),
    ] = None,
    days: Annotated[
        int, typer.Option(min=1, max=366, help="Report only what was seen on this many days.")
    ] = 1,
    as_object: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    topic: Topics = None,
    laser_pose: LaserPose = None,
    base_frame: BaseFrame = None,
    laser_frame: LaserFrame = None,
) -> None:
    """Compare a map with the scans of a localized robot: what is gone, what is new.

    Things count if they are seen from several places; people who walk by do not.
    """
    if truth and poses is not None:
        raise InputError("Choose one of --truth and --poses: both say where the robot was.")
    _check_targets(plot, out)
    from firstfix.io.logs.tum import load_trajectory
    from firstfix.io.maps.map_server import load_map

    grid = load_map(map_path)
    known = None if poses is None else load_trajectory(poses)
    recordings = [read_log(log, topic, laser_pose, base_frame, laser_frame) for log in logs]
    for note in dict.fromkeys(note for recording in recordings for note in recording.notes):
        typer.echo(f"note: {note}", err=True)

    # Imported after the files are read, so that bad input is refused at once.
    from firstfix.changes.survey import find_changes
    from firstfix.io.map_changes import load_counts
    from firstfix.lab.experiments.drive_changes import count_changes, merged_days
    from firstfix.lab.reports import changes_report
    from firstfix.plots.changes_picture import draw_changes

    before = [counts for folder in earlier or [] for counts in load_counts(folder, grid)]
    with progress(sum(map(len, recordings)), "comparing") as done:
        drives = [_sightings(recording, grid, known, truth=truth) for recording in recordings]
        counter = count_changes(grid, drives, done)
    counted = merged_days([*before, *counter.days])
    found = find_changes(grid, counted, days)
    if out is not None:
        folder = changes_report.write_changes(found, counted, counter.explained, out)
        typer.echo(f"written to {folder}", err=True)
    if plot is not None:
        picture = draw_changes(found, plot, changes_report.changes_title(found))
        typer.echo(f"picture: {picture}", err=True)
    if as_object:
        document = changes_report.changes_document(found, counter.explained)
        typer.echo(json.dumps(document, allow_nan=False))
    else:
        typer.echo(changes_report.changes_text(found, counter.explained))


def _sightings(
    recording: Recording, grid: OccupancyGrid, poses: Trajectory | None, *, truth: bool
) -> Iterator[Sighting]:
    from firstfix.lab.experiments.drive_changes import at_given_poses, where_localized

    if truth or poses is not None:
        return at_given_poses(recording, poses)
    return where_localized(recording, grid)


def _check_targets(plot: Path | None, out: Path | None) -> None:
    from firstfix.lab.reports.output_files import check_file, check_picture, make_folder

    if plot is not None:
        check_picture(plot)
        check_file(plot)
    if out is not None:
        make_folder(out)
