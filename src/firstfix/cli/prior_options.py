"""Options of ``locate`` and ``track`` that say where the robot may be."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.belief.prior import Near
    from firstfix.global_localization.prior import Prior

NearPoses = Annotated[
    list[str] | None,
    typer.Option(
        "--near",
        metavar="X,Y[,YAW]",
        help="The robot is near this pose (m, rad); repeat it where it is near one of several.",
    ),
]
Radius = Annotated[
    float | None,
    typer.Option(
        metavar="M", help="Distance by which --near may be wrong, m.", show_default=f"{1.0:g}"
    ),
]
RegionText = Annotated[
    str | None,
    typer.Option(
        "--region",
        metavar="ZONE|'X,Y X,Y X,Y ...'",
        help="The robot is inside this polygon (m), or in this zone of MAP.zones.yaml.",
    ),
]

_DEFAULT_RADIUS_M = 1.0
# What a person who gives a heading means by it.
_HEADING_RAD = math.radians(45.0)


def prior_of(
    map_path: Path, near: list[str] | None, radius: float | None, region: str | None
) -> Prior | None:
    """Return the prior of these options; None without any."""
    from firstfix.belief.prior import All, AnyOf, Region

    if radius is not None and not near:
        raise InputError("--radius is the distance from --near. Add --near X,Y, or leave it out.")
    priors: list[Prior] = []
    if near:
        reach = _DEFAULT_RADIUS_M if radius is None else radius
        places = tuple(_near(text, reach) for text in near)
        priors.append(places[0] if len(places) == 1 else AnyOf(places))
    if region is not None:
        priors.append(Region(_polygon(map_path, region)))
    return (priors[0] if len(priors) == 1 else All(tuple(priors))) if priors else None


def _near(text: str, radius: float) -> Near:
    from firstfix.belief.prior import Near
    from firstfix.core.se2 import SE2

    x, y, *yaw = _numbers(text, (2, 3), "--near", "2.5,1 or 2.5,1,1.57")
    return Near(SE2(x, y, yaw[0]), radius, _HEADING_RAD) if yaw else Near(SE2(x, y, 0.0), radius)


def _polygon(map_path: Path, region: str) -> tuple[tuple[float, float], ...]:
    if "," in region:
        corners = [_numbers(text, (2,), "--region", "'0,0 5,0 5,4 0,4'") for text in region.split()]
        return tuple((x, y) for x, y in corners)
    from firstfix.io.maps.zones import load_zones

    zones = load_zones(map_path)
    if region not in zones:
        raise InputError(f"There is no zone {region}. Choose one of {', '.join(zones)}.")
    return zones[region]


def _numbers(text: str, counts: tuple[int, ...], option: str, example: str) -> list[float]:
    try:
        numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) in counts and all(map(math.isfinite, numbers)):
        return numbers
    raise InputError(f"{option} {text} cannot be read. Write it like {option} {example}.")
