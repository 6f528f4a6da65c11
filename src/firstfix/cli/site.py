"""``firstfix site``: many maps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress
from firstfix.cli.sensor_options import BaseFrame, LaserFrame, LaserPose, Topics, read_log
from firstfix.core.errors import ScanError

if TYPE_CHECKING:
    from firstfix.site.result import SiteResult
    from firstfix.site.site import Site

NO_ANSWER = 1

site_app = typer.Typer(help="Many maps: which map, and where in it.", no_args_is_help=True)

SitePath = Annotated[
    Path, typer.Argument(metavar="SITE", help="Folder of map_server maps, or a site.yaml.")
]


@site_app.command()
def locate(
    site_path: SitePath,
    scans: Annotated[
        Path, typer.Argument(metavar="SCANS", help=".npz, ROS 1 or ROS 2 bag, or CARMEN log.")
    ],
    index: Annotated[int, typer.Option("--index", min=0, help="Which scan, from 0.")] = 0,
    as_lines: Annotated[bool, typer.Option("--json", help="Print one JSON line.")] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the answer: .png, .svg or .pdf.")
    ] = None,
    topic: Topics = None,
    laser_pose: LaserPose = None,
    base_frame: BaseFrame = None,
    laser_frame: LaserFrame = None,
) -> None:
    """Find the map in which a scan was taken, and the pose in it.

    Ends with exit status 0 if one place of one map is UNIQUE, and 1 if not.
    """
    from firstfix.core.estimate import Verdict

    if plot is not None:
        from firstfix.lab.reports.output_files import check_picture

        check_picture(plot)
    site = _load(site_path)
    recording = read_log(scans, topic, laser_pose, base_frame, laser_frame, index + 1)
    instants = recording.instants()
    if index >= len(instants):
        raise ScanError(
            f"There is no scan {index} in {scans}. Choose one up to {len(instants) - 1}."
        )
    _prepare(site)
    result = site.locate([recording.scans[i] for i in instants[index]])
    if as_lines:
        typer.echo(json.dumps(result.to_dict(index), allow_nan=False))
    else:
        typer.echo(_as_text(result))
    if plot is not None:
        result.plot(plot)
        typer.echo(f"picture: {plot}", err=True)
    if result.verdict is not Verdict.UNIQUE:
        raise typer.Exit(NO_ANSWER)


def _load(path: Path) -> Site:
    from firstfix.fields.cache import cache_folder
    from firstfix.site.site import Site

    return Site.load(path, cache_folder() / "sites")


def _prepare(site: Site) -> None:
    with progress(len(site.maps), "preparing maps") as done:
        site.prepare(done)
    for fault in site.faults.values():
        typer.echo(f"warning: {fault}", err=True)


def _as_text(result: SiteResult) -> str:
    from firstfix.lab.reports.text import pose_text

    lines = [
        f"{hypothesis.map_id:<24} {pose_text(hypothesis.pose)}  {hypothesis.probability:.1%}"
        for hypothesis in result.hypotheses[:5]
    ]
    head = f"{result.verdict.value}: {result.reason}"
    tail = f"time {result.elapsed_s:.3f} s, {len(result.searched)} maps searched"
    return "\n".join([head, *lines, tail])
