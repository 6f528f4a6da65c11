"""The option ``--changes``: what is known to have changed in a map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid

KnownChanges = Annotated[
    Path | None,
    typer.Option(
        "--changes",
        metavar="LAYER",
        help="What is known to have changed: changes.yaml of `firstfix map changes --out`. Beams "
        "at these cells contradict a pose less.",
    ),
]


def load_changed_map(map_path: Path, layer: Path | None) -> OccupancyGrid:
    """Load a map, with the cells marked that a layer of changes shows otherwise."""
    from firstfix.io.maps.map_server import load_map

    grid = load_map(map_path)
    return grid if layer is None else grid.with_changes(load_map(layer))
