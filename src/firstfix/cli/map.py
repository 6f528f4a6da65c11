"""``firstfix map``: what a map contains, its traps, and its perceptual aliasing."""

from __future__ import annotations

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
        "depth-camera or 3d-lidar; repeatable. Predicts how often one scan, one turn in place, "
        "and one metre of driving are enough.",
        rich_help_panel=PREDICTION,
    ),
]
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
) -> None:
    """Load a map as map_server does: print its size, warn of traps, find places that look alike.

    A simulated sensor takes one scan at random places, and each scan is located in the whole map.
    With --sensor or --plot the robot also turns and drives where one scan is not enough.
    """
    from firstfix.cli.map_prediction import print_predictions
    from firstfix.io.maps.check import check_map
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.experiments.perceptual_aliasing import sensor
    from firstfix.lab.reports.output_files import check_picture
    from firstfix.lab.simulation.rigs import Rig, parse_rig

    rigs = [parse_rig(text) for text in sensors or []]
    if plot is not None:
        check_picture(plot)
        rigs = rigs or [Rig((sensor(beams, fov, reach),), f"{fov:g}° x {reach:g} m")]
    found = check_map(map_path)
    _print_sizes(found)
    for warning in found.warnings:
        typer.echo(f"warning: {warning}")
    if not found.warnings:
        typer.echo("no traps found")
    if rigs:
        samples = SAMPLES if samples is None else samples
        print_predictions(load_map(map_path), rigs, samples, seed, plot)
    elif samples != 0:
        _print_aliasing(load_map(map_path), sensor(beams, fov, reach), samples, seed)


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
) -> None:
    """Draw a map as firstfix sees it: walls, free and unknown space, in the map frame."""
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.experiments.perceptual_aliasing import sensor
    from firstfix.lab.reports.map_picture import draw_grid
    from firstfix.lab.reports.output_files import check_picture

    target = plot or Path(f"firstfix-{map_path.resolve().stem}.png")
    check_picture(target)
    grid = load_map(map_path)
    size = f"{grid.width * grid.resolution:.2f} x {grid.height * grid.resolution:.2f} m"
    title = f"{map_path.name}: {size}, {grid.free_area:.1f} m² free"
    typer.echo(f"{size}, {grid.width} x {grid.height} cells, {grid.free_area:.1f} m² free")
    places = _survey(grid, sensor(beams, fov, reach), samples, seed) if aliasing else ()
    typer.echo(f"picture: {draw_grid(grid, target, title, places)}")


def _print_sizes(found: MapCheck) -> None:
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
    for title, text in rows:
        typer.echo(f"{title:<12}{text}")


def _survey(grid: OccupancyGrid, lidar: Lidar, samples: int | None, seed: int) -> list[Place]:
    from firstfix.lab.experiments.perceptual_aliasing import survey

    samples = SAMPLES if samples is None else samples
    with progress(samples, "locating") as done:
        return survey(grid, lidar, samples, seed, done)


def _print_aliasing(grid: OccupancyGrid, lidar: Lidar, samples: int | None, seed: int) -> None:
    if samples is None and grid.cells.size > MOST_CELLS:
        typer.echo(
            f"Perceptual aliasing was not measured: {grid.cells.size / 1e6:.0f} million cells take "
            f"a minute or more. Ask for it with --samples {SAMPLES}."
        )
        return
    try:
        places = _survey(grid, lidar, samples, seed)
    except MapError as error:
        typer.echo(
            "Perceptual aliasing cannot be measured: "
            f"expected {error.expected}, received {error.received}"
        )
        return
    typer.echo(
        f"\nOne scan ({lidar.beams} beams over {math.degrees(lidar.fov):g}°, "
        f"{lidar.range_max:g} m) at each of {len(places)} random places:"
    )
    for line in _lines(places):
        typer.echo(line)


def _lines(places: Sequence[Place]) -> list[str]:
    from firstfix.lab.experiments.perceptual_aliasing import Look, doubles, share
    from firstfix.lab.reports.text import pose_text

    meaning = {
        Look.FOUND: "the scan fits where it was taken, and nowhere else as well",
        Look.AMBIGUOUS: "it fits elsewhere, too: rooms look alike, or the range is too short",
        Look.LOST: "too few beams hit: the range is too short, or free cells are outdoors",
        Look.MISTAKEN: "another place fits better",
    }
    lines = [f"{look.value:<18}{share(places, look):6.1%}  {meaning[look]}" for look in Look]
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
