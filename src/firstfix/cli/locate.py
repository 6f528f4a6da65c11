"""``firstfix locate``: where the robot was when it took a scan."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.cli.progress import progress, working
from firstfix.core.errors import InputError, ScanError
from firstfix.global_localization.config import Method

if TYPE_CHECKING:
    from firstfix.core.recording import Recording

NO_ANSWER = 1


def locate(
    map_path: Annotated[Path, typer.Argument(metavar="MAP", help="YAML of a map_server map.")],
    scans: Annotated[
        Path, typer.Argument(metavar="SCANS", help=".npz, ROS 1 or ROS 2 bag, or CARMEN log.")
    ],
    index: Annotated[
        int | None, typer.Option("--index", min=0, help="Which scan, from 0.", show_default="0")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Locate every scan.")] = False,
    method: Annotated[Method, typer.Option(help="How the map is searched.")] = Method.FAST,
    as_lines: Annotated[bool, typer.Option("--json", help="Print one JSON line a scan.")] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the answer: .png, .svg or .pdf.")
    ] = None,
    topic: Annotated[
        str | None, typer.Option(help="Scan topic of a bag, where it has several.")
    ] = None,
) -> None:
    """Find the pose at which a scan was taken, anywhere in the map.

    One scan (not --all) ends with exit status 0 if its place is UNIQUE and 1 if it is not.
    """
    _check_options(index, every, plot)
    from firstfix.cli.answers import as_text
    from firstfix.core.estimate import Verdict
    from firstfix.io.logs.load import load_recording
    from firstfix.io.maps.map_server import load_map
    from firstfix.lab.experiments.case import truth_at

    grid = load_map(map_path)
    first = index or 0
    recording = load_recording(scans, topic=topic, max_scans=None if every else first + 1)
    chosen = range(len(recording)) if every else _only(recording, first)
    for note in recording.notes:
        typer.echo(f"note: {note}", err=True)

    with working("preparing the map"):
        # After the reading: input that cannot be used is told before the kernels are loaded.
        from firstfix.fields.cache import cache_folder
        from firstfix.global_localization.scan_matcher import ScanMatcher

        matcher = ScanMatcher(grid, method=method, cache_dir=cache_folder())
    # On a terminal the answers themselves show how far it is.
    with progress(0 if sys.stdout.isatty() else len(chosen), "locating") as done:
        for i in chosen:
            truth = truth_at(recording, i)
            result = matcher.locate(recording.scans[i])
            if as_lines:
                typer.echo(json.dumps(result.to_dict(i, truth), allow_nan=False))
            else:
                typer.echo(f"{f'scan {i}: ' if every else ''}{as_text(result, truth)}")
            done(result.verdict.value)
    if plot is not None:
        from firstfix.plots.answer_picture import draw_answer

        typer.echo(
            f"picture: {draw_answer(grid, recording.scans[i], result, plot, truth)}", err=True
        )
    if not every and result.verdict is not Verdict.UNIQUE:
        raise typer.Exit(NO_ANSWER)


def _check_options(index: int | None, every: bool, plot: Path | None) -> None:
    if every and (index is not None or plot is not None):
        raise InputError(
            expected="--all, or else one scan with --index or --plot",
            received=f"--all with {'--index' if index is not None else '--plot'}",
            remedy="leave one of them out",
        )
    if plot is not None:
        from firstfix.plots.figure import check_path, new_figure

        check_path(plot)
        new_figure(1.0, 1.0)  # says now, not after the work, that matplotlib is missing


def _only(recording: Recording, index: int) -> range:
    if index >= len(recording):
        raise ScanError(
            expected=f"a log with a scan of index {index}",
            received=f"{len(recording)} scans, 0 to {len(recording) - 1}",
            remedy="choose a smaller --index",
        )
    return range(index, index + 1)
