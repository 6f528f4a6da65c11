"""``firstfix map``: what a map contains, its traps, and its perceptual aliasing."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.map_changes import changes
from firstfix.cli.progress import progress
from firstfix.cli.usage import PlainUsage
from firstfix.core.errors import MapError
from firstfix.core.scan import MAX_BEAMS

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid
    from firstfix.io.maps.check import MapCheck
    from firstfix.lab.experiments.perceptual_aliasing import Place
    from firstfix.lab.simulation.lidar import Lidar

SAMPLES = 40

# A larger map takes some ten seconds to prepare: it is surveyed only on request.
MOST_CELLS = 10_000_000
MOST_PAIRS = 10

map_app = typer.Typer(help="Look at a map.", no_args_is_help=True)
map_app.command(cls=PlainUsage)(changes)

PANEL = "Perceptual aliasing: which places look alike"
MapPath = Annotated[Path, typer.Argument(metavar="MAP", help="YAML of a map_server map.")]
Samples = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=100_000,
        help="Number of random places; 0 for none.",
        show_default=f"{SAMPLES}, none above {MOST_CELLS // 1_000_000} million cells",
        rich_help_panel=PANEL,
    ),
]
Beams = Annotated[
    int, typer.Option(min=1, max=MAX_BEAMS, help="Of the sensor.", rich_help_panel=PANEL)
]
Fov = Annotated[
    float,
    typer.Option(metavar="DEGREES", min=1, max=360, help="Field of view.", rich_help_panel=PANEL),
]
Reach = Annotated[
    float,
    typer.Option(
        "--range", metavar="METRES", min=0.5, max=1000, help="Range.", rich_help_panel=PANEL
    ),
]
PREDICTION = "Prediction: what a sensor can do in this map"
Sensors = Annotated[
    list[str] | None,
    typer.Option(
        "--sensor",
        metavar="SENSOR",
        help="FOV,RANGE (degrees, m), 2xFOV,RANGE for two lasers at opposite corners, two-lasers, "
        "depth-camera, 3d-lidar or skewed-lidar; repeatable. Predicts how often one scan, one turn "
        "in place, and one metre of driving are enough.",
        rich_help_panel=PREDICTION,
    ),
]
AsObject = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Seed = Annotated[
    int, typer.Option(min=0, help="Of the places and the noise.", rich_help_panel=PANEL)
]


@map_app.command(cls=PlainUsage)
def check(
    map_path: MapPath,
    samples: Samples = None,
    beams: Beams = 360,
    fov: Fov = 360.0,
    reach: Reach = 12.0,
    seed: Seed = 0,
    sensors: Sensors = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw heat maps over the floor: where one scan, one turn, one metre are enough.",
            rich_help_panel=PREDICTION,
        ),
    ] = None,
    as_object: AsObject = False,
) -> None:
    """Load a map as map_server does: print its size, warn of traps, find places that look alike.

    A simulated sensor takes one scan at random places, and each scan is located in the whole map.
    With --sensor or --plot the robot also turns and drives where one scan is not enough.
    """
    from firstfix.cli.map_prediction import predictions
    from firstfix.io.maps.check import check_map
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.experiments.perceptual_aliasing import sensor
    from firstfix.lab.reports.map_document import aliasing_document, check_document
    from firstfix.lab.reports.output_files import check_picture
    from firstfix.lab.simulation.rigs import Rig, parse_rig

    rigs = [parse_rig(text) for text in sensors or []]
    if plot is not None:
        check_picture(plot)
        rigs = rigs or [Rig((sensor(beams, fov, reach),), f"{fov:g}° x {reach:g} m")]
    say = _nothing if as_object else typer.echo
    found = check_map(map_path)
    for line in _sizes(found):
        say(line)
    for warning in found.warnings:
        say(f"warning: {warning}")
    if not found.warnings:
        say("no traps found")
    document = {**check_document(found), "aliasing": None, "predictions": []}
    if rigs:
        samples = SAMPLES if samples is None else samples
        grid = load_map(map_path)
        document["predictions"] = predictions(grid, rigs, samples, seed, plot, say)
    elif samples != 0:
        lidar = sensor(beams, fov, reach)
        places, reason = _aliasing(load_map(map_path), lidar, samples, seed)
        if reason:
            typer.echo(reason, err=as_object)
        if places is not None:
            document["aliasing"] = aliasing_document(places)
            for line in _lines(lidar, places):
                say(line)
    if as_object:
        typer.echo(json.dumps(document, allow_nan=False))


def _nothing(line: str) -> None:
    """Print nothing: an object is printed instead."""
    del line


@map_app.command(cls=PlainUsage)
def show(
    map_path: MapPath,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The picture.", show_default="firstfix-NAME.png in this folder"
        ),
    ] = None,
    aliasing: Annotated[
        bool,
        typer.Option("--aliasing", "--alike", help="Mark places that look alike."),
    ] = False,
    samples: Samples = None,
    beams: Beams = 360,
    fov: Fov = 360.0,
    reach: Reach = 12.0,
    seed: Seed = 0,
    as_object: AsObject = False,
) -> None:
    """Draw a map as firstfix sees it: walls, free and unknown space, in the map frame."""
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.experiments.perceptual_aliasing import sensor
    from firstfix.lab.reports.map_document import aliasing_document, size_document
    from firstfix.lab.reports.map_picture import draw_grid
    from firstfix.lab.reports.output_files import check_picture

    target = plot or Path(f"firstfix-{map_path.resolve().stem}.png")
    check_picture(target)
    grid = load_map(map_path)
    size = f"{grid.width * grid.resolution:.2f} x {grid.height * grid.resolution:.2f} m"
    title = f"{map_path.name}: {size}, {grid.free_area:.1f} m² free"
    places = _survey(grid, sensor(beams, fov, reach), samples, seed) if aliasing else ()
    picture = draw_grid(grid, target, title, places)
    if as_object:
        alike = aliasing_document(places) if aliasing else None
        document = {**size_document(grid), "picture": f"{picture}", "aliasing": alike}
        typer.echo(json.dumps(document, allow_nan=False))
    else:
        typer.echo(f"{size}, {grid.width} x {grid.height} cells, {grid.free_area:.1f} m² free")
    typer.echo(f"picture: {picture}", err=True)


def _sizes(found: MapCheck) -> list[str]:
    origin = found.T_map_grid
    between = max(0.0, 1.0 - found.free - found.occupied - found.unknown)
    metres = f"{found.width_m:.2f} x {found.height_m:.2f} m"
    rows = [
        ("yaml", f"{found.yaml}"),
        ("image", f"{found.image} ({found.pixels})"),
        ("mode", found.mode.value),
        ("size", f"{found.width} x {found.height} cells, {metres}"),
        ("resolution", f"{found.resolution:g} m per cell"),
        ("origin", f"x {origin.x:g} m, y {origin.y:g} m, yaw {math.degrees(origin.yaw):.2f}°"),
        ("free", f"{found.free:.1%}, {found.free_area:.1f} m²"),
        ("occupied", f"{found.occupied:.1%}"),
        ("unknown", f"{found.unknown:.1%}"),
    ]
    if between > 0.0005:
        rows.append(("between", f"{between:.1%}"))
    return [f"{title:<12}{text}" for title, text in rows]


def _survey(grid: OccupancyGrid, lidar: Lidar, samples: int | None, seed: int) -> list[Place]:
    from firstfix.lab.experiments.perceptual_aliasing import survey

    samples = SAMPLES if samples is None else samples
    with progress(samples, "locating") as done:
        return survey(grid, lidar, samples, seed, done)


def _aliasing(
    grid: OccupancyGrid, lidar: Lidar, samples: int | None, seed: int
) -> tuple[list[Place] | None, str]:
    """Survey a map; return None and the reason where that cannot be done."""
    if samples is None and grid.cells.size > MOST_CELLS:
        return None, (
            f"Perceptual aliasing was not measured: {grid.cells.size / 1e6:.0f} million cells take "
            f"a minute or more. Ask for it with --samples {SAMPLES}."
        )
    try:
        return _survey(grid, lidar, samples, seed), ""
    except MapError as error:
        return None, (
            "Perceptual aliasing cannot be measured: "
            f"expected {error.expected}, received {error.received}"
        )


def _lines(lidar: Lidar, places: Sequence[Place]) -> list[str]:
    from firstfix.lab.experiments.perceptual_aliasing import Look, doubles, share
    from firstfix.lab.reports.text import pose_text

    meaning = {
        Look.FOUND: "the scan fits where it was taken, and nowhere else as well",
        Look.AMBIGUOUS: "it fits elsewhere, too: rooms look alike, or the range is too short",
        Look.LOST: "too few beams hit: the range is too short, or free cells are outdoors",
        Look.MISTAKEN: "another place fits better",
    }
    fov = math.degrees(lidar.fov)
    words = f"One scan ({lidar.beams} beams over {fov:g}°, {lidar.range_max:g} m)"
    lines = [f"\n{words} at each of {len(places)} random places:"]
    lines += [f"{look.value:<18}{share(places, look):6.1%}  {meaning[look]}" for look in Look]
    if any(place.needs_second_view for place in places):
        lines.append(
            "One scan of this sensor is never UNIQUE: it sees too little. The robot publishes a "
            "pose after a second view, 0.3 m or 15° further."
        )
    pairs = doubles(places)
    if pairs:
        lines += ["", "True pose of the scan  ~  other pose that fits, and its probability:"]
    lines += [
        f"{pose_text(pose)}  ~  {pose_text(double.pose)}  {double.probability:6.1%}"
        for pose, double in pairs[:MOST_PAIRS]
    ]
    if len(pairs) > MOST_PAIRS:
        lines.append(f"and {len(pairs) - MOST_PAIRS} more")
    return lines
