"""Which places of a map look alike: the options of the question, the work, and the answer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress, working
from firstfix.core.errors import MapError
from firstfix.core.scan import MAX_BEAMS

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid
    from firstfix.lab.experiments.perceptual_aliasing import Place
    from firstfix.lab.simulation.lidar import Lidar

SAMPLES = 40

# Preparing a map of this size takes some ten seconds: nobody waits that long without asking.
MOST_CELLS = 10_000_000

# Surveyed walls and a good sensor: what still looks alike does so because of the map.
SIGMA_M = 0.01

MOST_PAIRS = 10

PANEL = "Which places look alike"
Samples = Annotated[
    int | None,
    typer.Option(
        "--samples",
        min=0,
        max=100_000,
        help="Random places that are tried; 0 tries none.",
        show_default=f"{SAMPLES}, none above {MOST_CELLS // 1_000_000} million cells",
        rich_help_panel=PANEL,
    ),
]
Beams = Annotated[
    int,
    typer.Option("--beams", min=1, max=MAX_BEAMS, help="Of the sensor.", rich_help_panel=PANEL),
]
Fov = Annotated[
    float,
    typer.Option(
        "--fov", metavar="DEGREES", min=1, max=360, help="Its field of view.", rich_help_panel=PANEL
    ),
]
Reach = Annotated[
    float,
    typer.Option(
        "--range", metavar="METRES", min=0.5, max=1000, help="Its reach.", rich_help_panel=PANEL
    ),
]
Seed = Annotated[
    int,
    typer.Option("--seed", min=0, help="Another seed, other places.", rich_help_panel=PANEL),
]


def sensor(beams: int, fov_deg: float, range_m: float) -> Lidar:
    """Return the sensor that looks: without dropouts, and nearly without noise."""
    from firstfix.lab.simulation.lidar import Lidar

    return Lidar(beams=beams, fov=math.radians(fov_deg), range_max=range_m, sigma_m=SIGMA_M)


def look_around(grid: OccupancyGrid, lidar: Lidar, samples: int | None, seed: int) -> list[Place]:
    """Locate scans from random places of a map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    lidar : Lidar
        What looks at it.
    samples : int or None
        Number of places; None for the usual one.
    seed : int
        Of places and noise.

    Returns
    -------
    list of Place
        The places, and what they were taken for.

    Raises
    ------
    MapError
        If nothing can be located in the map.
    """
    import numpy as np

    from firstfix.fields.cache import cache_folder
    from firstfix.global_localization.scan_matcher import ScanMatcher
    from firstfix.global_localization.searchable import check_searchable
    from firstfix.lab.experiments.perceptual_aliasing import look_from
    from firstfix.lab.worlds.catalog import random_free_poses

    check_searchable(grid)
    samples = SAMPLES if samples is None else samples
    rng = np.random.default_rng(seed)
    with working("preparing the map"):
        poses = random_free_poses(grid, rng, samples)
        matcher = ScanMatcher(grid, cache_dir=cache_folder())
    places = []
    with progress(samples, "looking around") as done:
        for pose in poses:
            places.append(look_from(pose, matcher.locate(lidar.scan(grid, pose, rng))))
            done(places[-1].look.value)
    return places


def tell(grid: OccupancyGrid, lidar: Lidar, samples: int | None, seed: int) -> None:
    """Say how much of a map one scan finds, and which places of it look alike."""
    if samples is None and grid.cells.size > MOST_CELLS:
        typer.echo(
            f"which places look alike was not tried: with {grid.cells.size / 1e6:.0f} million "
            f"cells that takes a minute or more; ask for it with --samples {SAMPLES}"
        )
        return
    try:
        places = look_around(grid, lidar, samples, seed)
    except MapError as error:
        typer.echo(
            "which places look alike cannot be told: "
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
    from firstfix.cli.answers import pose_text
    from firstfix.lab.experiments.perceptual_aliasing import Look, doubles, share

    lines = [f"{look.value:<18}{share(places, look):6.1%}" for look in Look]
    pairs = doubles(places)
    if pairs:
        lines += ["", "Where a scan was taken  ~  where else it fits, and how likely that is:"]
    lines += [
        f"{pose_text(pose)}  ~  {pose_text(double.pose)}  {double.probability:6.1%}"
        for pose, double in pairs[:MOST_PAIRS]
    ]
    if len(pairs) > MOST_PAIRS:
        lines.append(f"and {len(pairs) - MOST_PAIRS} more")
    return lines
