"""``firstfix site``: many maps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress
from firstfix.cli.sensor_options import BaseFrame, LaserFrame, LaserPose, Topics, read_log
from firstfix.cli.usage import PlainUsage
from firstfix.core.errors import ScanError

if TYPE_CHECKING:
    from firstfix.lab.experiments.site_check import SiteCheck
    from firstfix.site.result import SiteResult
    from firstfix.site.site import Site

NO_ANSWER = 1
MOST_PAIRS = 10

site_app = typer.Typer(help="Many maps: which map, and where in it.", no_args_is_help=True)

SitePath = Annotated[
    Path, typer.Argument(metavar="SITE", help="Folder of map_server maps, or a site.yaml.")
]
SiteOption = Annotated[
    Path | None,
    typer.Option(
        metavar="SITE", help="Maps in one of which the robot is: a folder or a site.yaml."
    ),
]


@site_app.command(cls=PlainUsage)
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
    zone: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The robot is in this zone of site.yaml, in any map."),
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
    site = load_site(site_path)
    prior = None if zone is None else site.zone(zone)
    recording = read_log(scans, topic, laser_pose, base_frame, laser_frame, index + 1)
    instants = recording.instants()
    if index >= len(instants):
        raise ScanError(
            f"There is no scan {index} in {scans}. Choose one up to {len(instants) - 1}."
        )
    prepare_site(site)
    result = site.locate([recording.scans[i] for i in instants[index]], prior=prior)
    if as_lines:
        typer.echo(json.dumps(result.to_dict(index), allow_nan=False))
    else:
        typer.echo(_as_text(result))
    if plot is not None:
        result.plot(plot)
        typer.echo(f"picture: {plot}", err=True)
    if result.verdict is not Verdict.UNIQUE:
        raise typer.Exit(NO_ANSWER)


@site_app.command(cls=PlainUsage)
def check(
    site_path: SitePath,
    samples: Annotated[
        int, typer.Option(min=0, max=10_000, help="Simulated scans in each map; 0 for none.")
    ] = 3,
    seed: Annotated[int, typer.Option(min=0, help="Of the places and the noise.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw which maps look alike.")
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write a site.yaml with all maps, to be filled in.")
    ] = False,
) -> None:
    """Prepare all maps, and tell which are copies or look alike, and what a scan costs.

    A simulated sensor takes scans at random places of each map, and each scan is located in the
    whole site.
    """
    from firstfix.io.maps.site_skeleton import write_site_skeleton
    from firstfix.lab.experiments.site_check import check_site

    if write:
        typer.echo(f"site: {write_site_skeleton(site_path)}", err=True)
    if plot is not None:
        from firstfix.lab.reports.output_files import check_picture

        check_picture(plot)
    site = load_site(site_path)
    steps = len(site.maps) * (2 if samples else 1)
    with progress(steps, "checking maps") as done:
        found = check_site(site, samples, seed, done)
    if as_json:
        typer.echo(json.dumps(found.to_dict(), allow_nan=False))
    else:
        for line in _check_lines(found):
            typer.echo(line)
    if plot is not None:
        from firstfix.lab.reports.site_picture import draw_site

        typer.echo(f"picture: {draw_site(found, plot)}", err=True)


def _check_lines(found: SiteCheck) -> list[str]:
    area = sum(one.area_m2 for one in found.maps)
    scans = sum(one.scans for one in found.maps)
    right = sum(one.right for one in found.maps)
    lines = [
        f"maps          {len(found.maps)} usable, {len(found.faults)} not, {area:,.0f} m² free",
        f"memory        {found.nbytes / 1e6:,.0f} MB if all maps are in use",
        f"preparation   {found.prepare_s:.1f} s; files are kept for the next time",
    ]
    if scans:
        lines += [
            f"a scan        {found.query_s:.2f} s of processor time",
            f"right map     {right / scans:.1%} of {scans} simulated scans",
            f"UNIQUE        {found.unique / scans:.1%}, of which {found.wrong} in a wrong map",
        ]
    lines += [f"copies        {', '.join(names)}" for names in found.copies]
    lines += [f"warning: {fault}" for fault in found.faults]
    if found.alike:
        lines += ["", "Maps that look alike, and scans of the first that fit in the second, too:"]
    lines += [f"{pair.map_id}  ~  {pair.other}  {pair.scans}" for pair in found.alike[:MOST_PAIRS]]
    if len(found.alike) > MOST_PAIRS:
        lines.append(f"and {len(found.alike) - MOST_PAIRS} more (--json lists all)")
    return lines


def load_site(path: Path) -> Site:
    """Load a site, whose prepared maps are in the folder of the user."""
    from firstfix.fields.cache import cache_folder
    from firstfix.site.site import Site

    return Site.load(path, cache_folder() / "sites")


def prepare_site(site: Site) -> None:
    """Prepare all maps, and name those that cannot be used."""
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
