"""``firstfix map check --sensor``: what sensors can do in a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from firstfix.cli.progress import progress
from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.core.grid import OccupancyGrid
    from firstfix.lab.simulation.rigs import Rig


def predictions(
    grid: OccupancyGrid,
    rigs: Sequence[Rig],
    samples: int,
    seed: int,
    plot: Path | None,
    say: Callable[[str], None],
) -> list[dict[str, Any]]:
    """Predict, say and draw what each sensor can do; return it as JSON values."""
    from firstfix.lab.experiments.sensor_prediction import predict
    from firstfix.lab.reports.map_document import prediction_document
    from firstfix.lab.reports.prediction_report import draw_predictions, prediction_text

    if samples == 0:
        raise InputError("A prediction needs places. Choose --samples of at least 1.")
    found = []
    for rig in rigs:
        with progress(samples, rig.words) as done:
            found.append((rig.words, predict(grid, rig, samples, seed, done)))
        say("\n" + prediction_text(*found[-1], seed))
    if plot is not None:
        typer.echo(f"picture: {draw_predictions(grid, found, plot)}", err=True)
    return [prediction_document(words, predicted) for words, predicted in found]
