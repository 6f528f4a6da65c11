"""``firstfix case``: cases for the benchmarks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from firstfix.cli.sensor_options import (
    BaseFrame,
    HeightBand,
    LaserFrame,
    LaserPose,
    Topics,
    read_log,
)
from firstfix.cli.usage import PlainUsage

case_app = typer.Typer(help="Cases for firstfix bench.", no_args_is_help=True)


@case_app.callback()
def case() -> None:
    """Cases for firstfix bench: a map, scans, and the true poses."""


@case_app.command(cls=PlainUsage)
def make(
    map_path: Annotated[Path, typer.Argument(metavar="MAP", help="YAML of a map_server map.")],
    log: Annotated[
        Path, typer.Argument(metavar="LOG", help=".npz, ROS 1 or ROS 2 bag, or CARMEN log.")
    ],
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The new case.")],
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="TUM",
            help="True poses of the base in the map over time.",
            show_default="those in the log",
        ),
    ] = None,
    site: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="The building; cases of one site are never wrong maps for each other.",
            show_default="name of FOLDER",
        ),
    ] = None,
    kind: Annotated[
        str, typer.Option(help="Where the scans come from, such as real or sim.")
    ] = "real",
    topic: Topics = None,
    laser_pose: LaserPose = None,
    base_frame: BaseFrame = None,
    laser_frame: LaserFrame = None,
    height_band: HeightBand = None,
) -> None:
    """Make a case from a map, a log and the true poses.

    The truth is interpolated at the stamps of the scans; scans without it are kept for tracking.
    """
    from firstfix.io.logs.tum import load_trajectory
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.experiments.new_case import with_truth, write_case

    grid = load_map(map_path)
    known = None if truth is None else load_trajectory(truth)
    recording = read_log(log, topic, laser_pose, base_frame, laser_frame, None, height_band)
    for note in recording.notes:
        typer.echo(f"note: {note}", err=True)
    recording, scans = with_truth(recording, known)
    write_case(grid, recording, folder, site=site or folder.resolve().name, kind=kind)
    typer.echo(f"{folder}: {len(recording)} scans, {scans} with a true pose")
