"""``firstfix map check --sensor``: what sensors can do in a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from firstfix.cli.progress import progress
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid
    from firstfix.lab.simulation.rigs import Rig


def print_predictions(
    grid: OccupancyGrid, rigs: Sequence[Rig], samples: int, seed: int, plot: Path | None
) -> None:
    """Predict, print and draw what each sensor can do."""
    from firstfix.lab.experiments.sensor_prediction import predict
    from firstfix.lab.reports.prediction_report import draw_predictions, prediction_text

    if samples == 0:
        raise InputError("A prediction needs places. Choose --samples of at least 1.")
    found = []
    for rig in rigs:
        with progress(samples, rig.words) as done:
            found.append((rig.words, predict(grid, rig, samples, seed, done)))
        typer.echo("\n" + prediction_text(*found[-1], seed))
    if plot is not None:
        typer.echo(f"picture: {draw_predictions(grid, found, plot)}", err=True)
