"""``firstfix map``: what is in a map, and what about it may surprise."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli import map_aliasing as alike

if TYPE_CHECKING:
    from firstfix.io.maps.check import MapCheck

map_app = typer.Typer(help="Look at a map.", no_args_is_help=True)

MapPath = Annotated[Path, typer.Argument(metavar="MAP", help="YAML of a map_server map.")]


@map_app.command()
def check(
    map_path: MapPath,
    samples: alike.Samples = None,
    beams: alike.Beams = 360,
    fov: alike.Fov = 360.0,
    reach: alike.Reach = 12.0,
    seed: alike.Seed = 0,
) -> None:
    """Load a map as map_server would, print its sizes, warn of traps, and try what looks alike.

    A simulated sensor takes one scan at random places, and each scan is located in the whole map.
    """
    from firstfix.io.maps.check import check_map
    from firstfix.io.maps.map_server import load_map

    lidar = alike.sensor(beams, fov, reach)
    found = check_map(map_path)
    _tell_sizes(found)
    for warning in found.warnings:
        typer.echo(f"warning: {warning}")
    if not found.warnings:
        typer.echo("no traps found")
    if samples != 0:
        alike.tell(load_map(map_path), lidar, samples, seed)


def _tell_sizes(found: MapCheck) -> None:
    origin = found.T_map_grid
    between = max(0.0, 1.0 - found.free - found.occupied - found.unknown)
    rows = [
        ("yaml", f"{found.yaml}"),
        ("image", f"{found.image} ({found.pixels})"),
        ("mode", found.mode.value),
        (
            "size",
            f"{found.width} x {found.height} cells, {found.width_m:.2f} x {found.height_m:.2f} m",
        ),
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


@map_app.command()
def show(
    map_path: MapPath,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Where the picture goes.",
            show_default="firstfix-NAME.png here",
        ),
    ] = None,
    show_aliasing: Annotated[
        bool,
        typer.Option(
            "--aliasing", "--alike", help="Mark which places look alike, as 'map check' does."
        ),
    ] = False,
    samples: alike.Samples = None,
    beams: alike.Beams = 360,
    fov: alike.Fov = 360.0,
    reach: alike.Reach = 12.0,
    seed: alike.Seed = 0,
) -> None:
    """Draw a map as firstfix sees it: walls, free and unknown space, in the map frame."""
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.reports.map_picture import draw_grid
    from firstfix.plots.figure import check_path, new_figure

    target = plot or Path(f"firstfix-{map_path.resolve().stem}.png")
    check_path(target)
    new_figure(1.0, 1.0)  # says now, not after the work, that matplotlib is missing
    lidar = alike.sensor(beams, fov, reach)
    grid = load_map(map_path)
    size = f"{grid.width * grid.resolution:.2f} x {grid.height * grid.resolution:.2f} m"
    title = f"{map_path.name}: {size}, {grid.free_area:.1f} m² free"
    typer.echo(f"{size}, {grid.width} x {grid.height} cells, {grid.free_area:.1f} m² free")
    places = alike.look_around(grid, lidar, samples, seed) if show_aliasing else ()
    typer.echo(f"picture: {draw_grid(grid, target, title, places)}")
